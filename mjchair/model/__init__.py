"""The chair as an MJCF model: files, parameters, and the specification that is made from them."""
