"""Plan a study, and log its trials."""
