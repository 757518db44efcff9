"""Evaluation: plans, rollouts and the runner that stores their records."""
