"""The page about a run: what is in it, and how it is served."""
