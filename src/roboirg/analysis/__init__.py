"""Functions of records alone: rates, tables, the HTML report."""
