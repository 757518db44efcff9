"""Checks of a policy: each asks it with controlled inputs and compares the answers."""
