"""Performance of this machine, compared with the floor and the stock path."""
