"""The tasks, one file each; a file that defines ``TASK`` is a task.

Three suites are the benchmark. The suite ``real`` holds the simulated twins of the real-robot
tasks. Installed packages add tasks, in suites of their own, through entry points of the group
``roboirg.tasks``. Tasks outside the benchmark are played, worded and judged like all others, but
only on request: by name or by suite.
"""

from __future__ import annotations

import functools
from collections.abc import Iterable, Mapping
from dataclasses import replace

from roboirg.core.episode import BENCHMARK_SUITES, SUITES, Episode, Goal
from roboirg.core.errors import InvalidValueError, UnknownNameError
from roboirg.tasks.task import Task
from roboirg.util.discovery import discover_in_modules, with_entries

__all__ = [
    "Task",
    "all_suites",
    "all_tasks",
    "every_task",
    "find_tasks",
    "get_task",
    "goals_of",
    "with_goal",
]

ALL = "all"
"""Stands for all tasks of the benchmark wherever tasks are named."""
ENTRY_POINTS = "roboirg.tasks"
LEFT_OUT = ("PickHighlight", "MoveCube", "InsertPeg", "PatternLock", "RouteStick")
"""Tasks of RoboMME whose instructions hold no variable that could be referred to."""


@functools.cache
def all_tasks(suites: tuple[str, ...] = BENCHMARK_SUITES) -> Mapping[str, Task]:
    """Return the tasks of some suites by name, ordered by code; by default the benchmark's.

    A task's `code` is its fixed number. ``all_tasks(("real",))`` -> ``{"PutInBox": Task(…),
    "PickByCount": Task(…)}``.
    """
    chosen = (task for task in _registry() if task.suite in suites)
    return {task.name: task for task in sorted(chosen, key=lambda task: task.code)}


@functools.cache
def all_suites() -> tuple[str, ...]:
    """Return the names of all suites: the benchmark's, ``real``, then those of other packages.

    Each name once; for example ``("counting", "permanence", "reference", "real", "my-suite")``.
    """
    return tuple(dict.fromkeys((*SUITES, *(task.suite for task in _registry()))))


def every_task() -> Mapping[str, Task]:
    """Return every task by name: the benchmark's, the real robot's, then those of packages.

    Within each of these three groups, tasks are ordered by their `code`.
    """
    # The suites of packages are ordered by code together.
    of_packages = tuple(suite for suite in all_suites() if suite not in SUITES)
    return {**all_tasks(SUITES), **all_tasks(of_packages)}


def get_task(name: str) -> Task:
    """Return the task of that name, spelled exactly so, such as ``"PickXtimes"``.

    Raises:
        InvalidValueError: there is no such task; the message suggests one with a similar name.
    """
    try:
        return every_task()[name]
    except KeyError:
        raise _unknown_task(str(name), every_task()) from None


def find_tasks(words: Iterable[str]) -> tuple[str, ...]:
    """Return the names of tasks for names of tasks or suites, or ``all`` for the benchmark.

    ``["real", "BinFill"]`` -> ``("PutInBox", "PickByCount", "BinFill")``.

    Returns:
        Names of tasks, each once: those of ``all`` first, the others in the order of the words.

    Raises:
        InvalidValueError: a word names neither a task nor a suite.
    """
    words = list(words)
    for_all = [word for word in words if word.lower() == ALL]
    others = [word for word in words if word.lower() != ALL]
    names: list[str] = []
    for word in (*for_all, *others):
        names += _expand(word)
    return tuple(dict.fromkeys(names))


def goals_of(episode: Episode) -> tuple[Goal, ...]:
    """Return all goals that the episode's scene allows, its own goal among them.

    A PickXtimes scene with a red and a blue cube: *red once* to *red five times*, then the same of
    blue.
    """
    return get_task(episode.task).goals(episode.scene)


def with_goal(episode: Episode, goal: Goal) -> Episode:
    """Return the episode with another goal of the same scene, and with the stages that lead to it.

    The episode that is given stays as it is; scene, seed and number are kept.
    """
    stages = get_task(episode.task).stages(episode.scene, goal)
    return replace(episode, goal=goal, stages=stages)


@functools.cache
def _registry() -> tuple[Task, ...]:
    """Return all tasks: ours, then those of installed packages, which must not enter our suites.

    Raises:
        InvalidValueError: a package puts its task into a suite of this package.
    """
    ours = discover_in_modules(__name__, "TASK", Task)
    tasks = with_entries(ours, "TASK", Task, ENTRY_POINTS).values()
    for task in tasks:
        if task not in ours and task.suite in SUITES:
            raise InvalidValueError(
                f"The task {task.name} of another package is in the suite {task.suite!r}, which "
                "only this package may fill; give it a suite of its own, such as "
                f"{task.suite + '-more'!r}."
            )
    return tuple(tasks)


def _expand(word: str) -> tuple[str, ...]:
    """Return the names of the tasks that a word stands for: of all, of a suite, or of one.

    Suites and ``all`` may be typed in any case, tasks only as they are spelled.
    """
    if word.lower() == ALL:
        return tuple(all_tasks())
    for suite in all_suites():
        if suite.lower() == word.lower():
            return tuple(all_tasks((suite,)))
    if word not in every_task():
        raise _unknown_task(word, (*every_task(), *all_suites()))
    return (word,)


def _unknown_task(name: str, known: Iterable[str]) -> InvalidValueError:
    """Return (not raise) the error about a name that is none of the known ones.

    A task of RoboMME that is left out on purpose, such as MoveCube, gets the reason; any other name
    gets a suggestion from `known`.
    """
    others = [task for task in LEFT_OUT if task.lower() != name.lower()]
    if len(others) < len(LEFT_OUT):
        return InvalidValueError(
            f"RoboMME's task {name!r} is left out: its instructions hold no variable to refer to. "
            f"So are {', '.join(others)}."
        )
    return UnknownNameError("task", name, known)
