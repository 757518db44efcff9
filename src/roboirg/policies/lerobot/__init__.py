"""Checkpoints of LeRobot as policies."""
