"""Registers every task's environment with Gymnasium when imported.

``gymnasium.make("roboirg.envs.registration:RoboIRG/PickXtimes-v1", setting="spatial")`` imports
this module.
"""

from __future__ import annotations

from gymnasium.envs.registration import register

from roboirg.core.episode import ENVIRONMENT_VERSION
from roboirg.tasks import every_task

NAMESPACE = "RoboIRG"


def environment_id(task: str) -> str:
    """Return the registered id of a task's environment, such as ``RoboIRG/PickXtimes-v1``."""
    return f"{NAMESPACE}/{task}-v{ENVIRONMENT_VERSION}"


def register_environments() -> None:
    """Register the environments of all tasks, those of other packages included."""
    for task in every_task():
        register(
            id=environment_id(task),
            entry_point="roboirg.envs.environment:RoboIRGEnv",
            kwargs={"task": task},
        )


register_environments()
