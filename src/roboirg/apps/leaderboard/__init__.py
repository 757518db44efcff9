"""Results that others can check: verification, packed runs, repeated runs, and the leaderboard."""
