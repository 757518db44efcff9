"""Inspection of one episode: its scene in words, and a strip of pictures of the oracle's play."""
