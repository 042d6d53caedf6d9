"""Measured motion of a person: markers in, angles of the rider's joints out."""
