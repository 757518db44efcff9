"""Tables of results for terminals, papers and programs."""
