"""The tasks, one file each; a file that defines ``TASK`` is a task of the benchmark."""

from __future__ import annotations

import functools
import importlib
import pkgutil
from collections.abc import Mapping

from roboirg.errors import UnknownNameError
from roboirg.tasks.task import Task

__all__ = ["Task", "all_tasks", "get_task"]


@functools.cache
def all_tasks() -> Mapping[str, Task]:
    """Every task by name, in the order of their codes."""
    modules = (
        importlib.import_module(f"{__name__}.{found.name}")
        for found in pkgutil.iter_modules(__path__)
    )
    tasks = [module.TASK for module in modules if hasattr(module, "TASK")]
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
