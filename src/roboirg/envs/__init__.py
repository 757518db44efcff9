"""The Gymnasium environment and its registration."""
