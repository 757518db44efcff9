"""What a policy is, what it may want, and how it is played; every other folder builds on this."""
