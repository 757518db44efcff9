"""The Gymnasium environment, `make`, and registration with Gymnasium."""
