"""Explanations of the gap: its test, the missing force, candidates, and their search."""
