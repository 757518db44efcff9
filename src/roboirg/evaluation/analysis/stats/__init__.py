"""Statistics of records: cells, rates, intervals, paired tests, power."""
