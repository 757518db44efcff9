"""Statistics of trials, from numbers alone: cells, rates, intervals, paired tests, power."""
