"""The scripted expert: motion planning, grasping and motion primitives."""
