"""Helpers without robot code: cache, parallel map, discovery, plain text, text in pictures."""
