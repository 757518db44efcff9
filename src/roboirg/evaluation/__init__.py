"""Plans, rollouts, records: from a command line to a file that survives."""
