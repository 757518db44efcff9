"""Helpers without robot code: cache, parallel map, discovery, plurals, text in pictures."""
