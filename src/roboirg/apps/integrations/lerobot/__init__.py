"""RoboIRGBench in LeRobot.

``--env.type=roboirg`` is registered by
``--env.discover_packages_path=roboirg.apps.integrations.lerobot``, and by installing the
distribution ``lerobot_env_roboirg``, which calls `register`.
"""


def register() -> None:
    """Register ``--env.type=roboirg``, once."""
    import roboirg.apps.integrations.lerobot.env_config  # noqa: F401
