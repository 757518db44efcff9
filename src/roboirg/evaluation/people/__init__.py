"""People as listeners and as policies: studies, pages, and the answers that are kept."""
