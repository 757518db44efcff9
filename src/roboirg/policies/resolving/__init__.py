"""Rewriters in front of a policy: what was said becomes an explicit command, which it hears."""
