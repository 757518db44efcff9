"""Validation of the instructions: read every one back, and check its rules."""
