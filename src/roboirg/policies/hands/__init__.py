"""Hands for planners without a policy: subgoals in words, executed by the scripted expert."""
