"""The tasks, one file each: a module that defines ``TASK`` is a task.

The tasks of three suites are the benchmark. The suite ``real`` has the simulated twins of the tasks
for a real robot. They work like all others, but are selected only by their names or their suite,
as are tasks of other packages with suites of their own.
"""

from __future__ import annotations

import functools
import sys
from collections.abc import Iterable, Mapping

from roboirg.core.episode import BENCHMARK_SUITES, SUITES, Suite
from roboirg.core.errors import UnknownNameError
from roboirg.tasks.task import Task
from roboirg.util.discovery import discover

__all__ = ["Task", "all_tasks", "every_task", "find_tasks", "get_task"]

ALL = "all"
"""The word for all tasks of the benchmark."""


def all_tasks(suites: tuple[Suite, ...] = BENCHMARK_SUITES) -> Mapping[str, Task]:
    """Return the tasks of some suites, by default of the benchmark, by name, sorted by code."""
    return {name: task for name, task in every_task().items() if task.suite in suites}


@functools.cache
def every_task() -> Mapping[str, Task]:
    """Return all tasks, of the benchmark and of other suites, by name, sorted by code."""
    tasks: list[Task] = discover(sys.modules[__name__], "TASK")
    return {task.name: task for task in sorted(tasks, key=lambda task: task.code)}


def get_task(name: str) -> Task:
    """Return the task of that name.

    Raises:
        UnknownNameError: there is none; the message lists all and names the nearest.
    """
    try:
        return every_task()[name]
    except KeyError:
        raise UnknownNameError("task", name, every_task()) from None


def find_tasks(words: Iterable[str]) -> tuple[str, ...]:
    """Return the names of the tasks that some words select.

    Args:
        words: names of tasks or suites, or ``all`` for the benchmark.

    Returns:
        Each name once: those of ``all`` first, the others in the order of the words.

    Raises:
        UnknownNameError: a word is none of these.
    """
    ordered = sorted(words, key=lambda word: word.lower() != ALL)
    return tuple(dict.fromkeys(name for word in ordered for name in _select(word)))


def _select(word: str) -> tuple[str, ...]:
    """Return the names of the tasks that a word selects."""
    if word.lower() == ALL:
        return tuple(all_tasks())
    suites = dict.fromkeys((*SUITES, *(task.suite for task in every_task().values())))
    for suite in suites:
        if suite.lower() == word.lower():
            return tuple(all_tasks((suite,)))
    if word not in every_task():
        raise UnknownNameError("task", word, (*every_task(), *suites))
    return (word,)
