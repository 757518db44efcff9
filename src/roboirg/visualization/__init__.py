"""One episode to look at: its scene in words and a sheet of pictures of how the oracle plays it."""
