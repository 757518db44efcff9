"""Analysis of records alone: statistics, tables, figures and the HTML page."""
