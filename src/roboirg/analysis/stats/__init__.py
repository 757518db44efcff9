"""Statistics of records: rates, intervals, paired tests, power."""
