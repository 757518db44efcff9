"""The vector environment: sub-environments in worker processes."""
