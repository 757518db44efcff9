"""Policies behind a network connection: their protocols, clients and servers."""
