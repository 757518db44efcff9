"""Demonstrations: planned once and replayed; pictures of them are drawn when they are read."""
