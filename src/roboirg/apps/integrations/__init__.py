"""RoboIRGBench in other harnesses: LeRobot, vla-eval and Inspect, and their results as records."""
