"""For authors of scenarios: check them, and have texts rated."""
