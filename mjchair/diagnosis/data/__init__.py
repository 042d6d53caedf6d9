"""A study: its files, checks of its trials, first states, windows, and what is roughly known."""
