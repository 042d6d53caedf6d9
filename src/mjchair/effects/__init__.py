"""Named physical effects, each an edit of an MjSpec."""
