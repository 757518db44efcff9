"""Studies with a real robot: plans, sheets to print, and the page for scoring."""
