"""Pages for operators: the score page and printed sheets."""
