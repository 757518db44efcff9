"""Plan and run a study, and log its trials."""
