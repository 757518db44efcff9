"""Commands of the benchmark and its runs, and the options that commands share."""
