"""Demonstrations that people recorded on a robot: read, checked and converted."""
