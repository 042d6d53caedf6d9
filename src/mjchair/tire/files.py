"""Tire files: this project's TOML."""
