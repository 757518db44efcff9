"""The wording files that a process has opened.

A process knows a wording file by its identity, name and fingerprint, once it has opened it: the
options of an instruction hold the identity, and a job also says which file to open.
"""

from __future__ import annotations

import functools
from pathlib import Path

from msgspec.structs import replace

from roboirg.core.errors import InvalidValueError
from roboirg.core.word_pools import POOLS, outside_words
from roboirg.language.scenarios.scenario import TaskScenarios
from roboirg.language.scenarios.scenario_file import setting_scenarios, task_scenarios, words_in
from roboirg.language.scenarios.wording_file import Wordings, read_wordings

_OPEN: dict[str, Wordings] = {}
"""The wordings of this process by identity."""


def open_wordings(path: str | Path | None, identity: str | None = None) -> str | None:
    """Open a wording file for this process, and return its identity; None for no file.

    Args:
        path: the file, or the identity of wordings that are open; ``train`` or ``test`` for the
            words of that pool; None for our own words.
        identity: the wordings that are wanted; None for those of the file.
    """
    if identity in _OPEN:
        return identity
    if path in POOLS or identity in POOLS:
        return str(identity or path)
    if path is None:
        if identity is not None:
            raise InvalidValueError(f"The wordings {identity} need their file; none was given.")
        return None
    wordings = _OPEN.get(str(path)) or read_wordings(path)
    if identity not in (None, wordings.identity):
        raise InvalidValueError(
            f"The wording file {str(path)!r} holds {wordings.identity}, but the episodes need "
            f"{identity}; put the file back, or start again in another folder."
        )
    return register_wordings(wordings)


def register_wordings(wordings: Wordings) -> str:
    """Make wordings known to this process; return their identity."""
    _OPEN[wordings.identity] = wordings
    return wordings.identity


def find_wordings(identity: str) -> Wordings:
    """Return wordings that this process has opened."""
    if identity not in _OPEN:
        raise InvalidValueError(
            f"The wordings {identity!r} are not open; call open_wordings with their file first."
        )
    return _OPEN[identity]


def task_words(task: str, setting: str, wordings: str | None) -> TaskScenarios | None:
    """Return what is said of a task in a setting; None if nothing has been written.

    Args:
        task: its name.
        setting: its name; a setting whose own file serves the task says nothing else.
        wordings: the identity of open wordings; None, or a pool, for our own words.
    """
    identity = outside_words(wordings)
    if identity is None or task in setting_scenarios(setting):
        return words_in(setting, task)
    return _with_ours(task, identity)


@functools.cache
def _with_ours(task: str, identity: str) -> TaskScenarios | None:
    """Return the words of a wording file, with our scenarios in the settings where it has none."""
    ours, theirs = task_scenarios(task), find_wordings(identity).tasks.get(task)
    if ours is None or theirs is None:
        return theirs
    settings = {scenario.fields.setting for scenario in theirs.scenarios}
    others = [one for one in ours.scenarios if one.fields.setting not in settings]
    return replace(theirs, scenarios=[*theirs.scenarios, *others])
