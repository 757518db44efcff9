"""Planning and running a study, and the log of its trials."""
