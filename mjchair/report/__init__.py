"""Reports: films and figures of a recording."""
