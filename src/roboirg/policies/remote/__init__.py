"""Policies behind a network connection: one file per wire protocol over shared pieces."""
