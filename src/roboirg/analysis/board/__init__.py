"""A leaderboard page made of packed runs."""
