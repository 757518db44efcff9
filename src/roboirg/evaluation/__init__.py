"""Plans, runs and records of episodes, and all that follows from records."""
