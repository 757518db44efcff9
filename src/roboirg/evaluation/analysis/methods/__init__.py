"""A methods section that writes itself from the records of a run."""
