"""Plain data and rules that every other package may import."""
