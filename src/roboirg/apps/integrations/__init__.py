"""RoboIRGBench in other harnesses: LeRobot, vla-eval and Inspect."""
