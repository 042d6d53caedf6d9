"""Where model and measurement disagree, and which effect is missing."""
