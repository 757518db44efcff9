"""Registers every task's environment with Gymnasium when imported.

``gymnasium.make("roboirg.envs.registration:RoboIRG/PickXtimes-v0", setting="spatial")`` imports
this module.
"""

from __future__ import annotations

import gymnasium

from roboirg.core.episode import ENVIRONMENT_VERSION
from roboirg.tasks import every_task

NAMESPACE = "RoboIRG"


def environment_id(task: str) -> str:
    """Return the registered id of a task's environment."""
    return f"{NAMESPACE}/{task}-v{ENVIRONMENT_VERSION}"


for _task in every_task():
    gymnasium.register(
        id=environment_id(_task),
        entry_point="roboirg.envs.environment:RoboIRGEnv",
        kwargs={"task": _task},
    )
