"""For authors of language 4: check scenarios, and have texts rated."""
