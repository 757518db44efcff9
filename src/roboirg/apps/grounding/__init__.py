"""Grounding without a robot: the questions as a dataset, and scores of answers to them."""
