"""Helpers that know nothing of robots: caching, parallel work, discovery, text in pictures."""
