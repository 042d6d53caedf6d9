"""Replay of measured runs: windows simulated, their states, derivatives, sensor errors, noise."""
