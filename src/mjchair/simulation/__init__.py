"""Simulation: drive inputs, and the recording that a run leaves."""
