"""Demonstrations for training: recorded once per episode, written in the trainers' formats."""
