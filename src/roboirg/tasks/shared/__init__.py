"""What several tasks share: fixtures, placement, layouts, stages of videos."""
