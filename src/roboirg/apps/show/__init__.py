"""Inspection of one episode: its scene in words, and a contact sheet of the oracle's play."""
