"""Named physical effects; each one is an edit of an MjSpec."""
