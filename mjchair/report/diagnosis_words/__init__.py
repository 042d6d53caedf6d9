"""What the report of a diagnosis says, in plain sentences."""
