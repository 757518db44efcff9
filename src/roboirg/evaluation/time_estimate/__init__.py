"""How long a run takes, before it starts."""
