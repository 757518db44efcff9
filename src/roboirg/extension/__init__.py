"""What packages built on the benchmark import: the names of these modules stay."""
