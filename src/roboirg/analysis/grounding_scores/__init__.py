"""Scores of answers to the grounding dataset."""
