"""What operators read: the score page, printed sheets and figures."""
