"""The replaying policy as a plugin of LeRobot (``--policy.discover_packages_path``)."""
