"""Runs: plans, and how their episodes are played, hosted and distributed."""
