"""Control a real robot or its simulated twin."""
