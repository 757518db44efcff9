"""Makes the environments known to Gymnasium, which calls this through an entry point."""

from __future__ import annotations

import gymnasium

from roboirg.tasks import all_tasks

NAMESPACE = "RoboIRG"
VERSION = 0
"""Goes up whenever scores could change."""


def register_environments() -> None:
    """Register ``RoboIRG/<task>-v0`` for every task.

    Gymnasium enters the namespace itself when it loads the entry point.
    """
    for name in all_tasks():
        gymnasium.register(
            id=f"{name}-v{VERSION}",
            entry_point="roboirg.environment:RoboIRGEnv",
            kwargs={"task": name},
        )
