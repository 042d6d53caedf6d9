"""People's own files into a study: found, read, turned to forward, put on one clock, written."""
