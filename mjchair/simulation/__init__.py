"""Simulation: the inputs that drive a chair, and the recording of a run."""
