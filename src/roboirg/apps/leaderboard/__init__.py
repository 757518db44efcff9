"""Results that others can check: verification, and packed runs."""
