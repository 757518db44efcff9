"""Plain data and rules that every other room may import."""
