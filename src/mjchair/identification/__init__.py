"""Identification: rig data to tire coefficients, with what the data cannot determine said."""
