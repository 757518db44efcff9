"""Search for the seeds of the splits."""
