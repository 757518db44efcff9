"""What follows from records: measured rates and gaps, tables, figures and the HTML page."""
