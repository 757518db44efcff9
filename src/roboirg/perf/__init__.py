"""How fast this machine plays episodes, against the floor and against the stock path."""
