"""Our measures of speed and memory, with their goals; `scripts/bench.py` runs them."""
