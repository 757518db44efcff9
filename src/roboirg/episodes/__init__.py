"""The splits: which episodes there are, and fingerprints that notice a change."""
