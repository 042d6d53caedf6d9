"""mjchair."""
