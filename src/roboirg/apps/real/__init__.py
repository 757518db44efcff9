"""Studies with a real robot: plans, the operator's page, the control loop and the twin."""
