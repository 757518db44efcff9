"""The control loop on a real robot or its simulated twin."""
