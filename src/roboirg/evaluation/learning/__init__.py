"""Listeners that learn, compared: what words, settings, pictures and video bring."""
