"""Fits: whitening of residuals, elimination of window states, least squares."""
