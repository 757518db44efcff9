"""Shared by several tasks: fixtures, placement, layouts, stages of videos."""
