"""Demonstrations: planned once, then replayed; their pictures are drawn when they are read."""
