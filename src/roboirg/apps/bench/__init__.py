"""How fast this machine is, compared with the floor and the stock path."""
