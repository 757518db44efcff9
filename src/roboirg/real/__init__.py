"""The real-robot kit: plans, the operator's page, the control loop and the twin."""
