"""People as listeners and as policies: pages of a study, what people answered, the arm driven."""
