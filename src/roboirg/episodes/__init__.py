"""The splits: the episodes of the benchmark, and fingerprints that detect changes."""
