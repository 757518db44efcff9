"""The tasks, one file each; a file that defines ``TASK`` is a task.

Those of three suites are the benchmark. The suite ``real`` has the twins of the tasks for a real
robot: they are played, told and judged like all others, but are asked for by their names or by
their suite's.
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
"""Stands for all tasks of the benchmark where tasks are named."""


@functools.cache
def all_tasks(suites: tuple[Suite, ...] = BENCHMARK_SUITES) -> Mapping[str, Task]:
    """The tasks of some suites, by default of the benchmark, by name and in the order of codes."""
    tasks: list[Task] = discover(sys.modules[__name__], "TASK")
    chosen = (task for task in tasks if task.suite in suites)
    return {task.name: task for task in sorted(chosen, key=lambda task: task.code)}


def every_task() -> Mapping[str, Task]:
    """Every task there is, inside the benchmark and beside it."""
    return all_tasks(SUITES)


def get_task(name: str) -> Task:
    """The task of that name.

    Raises:
        UnknownNameError: there is none; the message lists all and names the nearest.
    """
    try:
        return every_task()[name]
    except KeyError:
        raise UnknownNameError("task", name, every_task()) from None


def find_tasks(words: Iterable[str]) -> tuple[str, ...]:
    """The tasks that are meant by names of tasks, of suites, or ``all`` for the benchmark.

    Returns:
        Their names, each once: those of ``all`` first, the others in the order of the words.

    Raises:
        UnknownNameError: a word is none of these.
    """
    in_turn = sorted(words, key=lambda word: word.lower() != ALL)
    return tuple(dict.fromkeys(name for word in in_turn for name in _meant(word)))


def _meant(word: str) -> tuple[str, ...]:
    lower = word.lower()
    if lower == ALL:
        return tuple(all_tasks())
    suite = next((one for one in SUITES if one == lower), None)
    if suite is not None:
        return tuple(all_tasks((suite,)))
    if word not in every_task():
        raise UnknownNameError("task", word, (*every_task(), *SUITES))
    return (word,)
