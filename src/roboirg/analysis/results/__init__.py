"""Results as one table, and what its rows and columns are called."""
