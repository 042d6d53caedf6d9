"""The chair as an MJCF model: files, parameters, and the specification made of them."""
