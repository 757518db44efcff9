"""RoboMME's sentences as a wording file."""
