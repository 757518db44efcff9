"""The grounding dataset: what was shown, what is seen, what was said, and what is meant."""
