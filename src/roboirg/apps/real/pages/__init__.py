"""Pages for operators and readers: the score page, printed sheets and figures."""
