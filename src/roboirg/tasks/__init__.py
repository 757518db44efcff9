"""The tasks, one file each; a file that defines ``TASK`` is a task of the benchmark."""

from __future__ import annotations

import functools
import sys
from collections.abc import Mapping

from roboirg.discovery import offered
from roboirg.errors import UnknownNameError
from roboirg.tasks.task import Task

__all__ = ["Task", "all_tasks", "get_task"]


@functools.cache
def all_tasks() -> Mapping[str, Task]:
    """Every task by name, in the order of their codes."""
    tasks: list[Task] = offered(sys.modules[__name__], "TASK")
    return {task.name: task for task in sorted(tasks, key=lambda task: task.code)}


def get_task(name: str) -> Task:
    """The task of that name.

    Raises:
        UnknownNameError: there is none; the message lists all and names the nearest.
    """
    try:
        return all_tasks()[name]
    except KeyError:
        raise UnknownNameError("task", name, all_tasks()) from None
