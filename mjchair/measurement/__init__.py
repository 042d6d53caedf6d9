"""Measurements: measured runs and instrumented wheels, read and validated."""
