"""Demonstrations for training: recorded once, written in the trainers' formats, replayed."""
