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
from roboirg.language.scenarios.scenario import COMMANDS, TaskScenarios
from roboirg.language.scenarios.scenario_file import words_in
from roboirg.language.scenarios.wording_file import Wordings, read_wordings

_OPEN: dict[str, Wordings] = {}
"""The wordings of this process by identity."""


def open_wordings(path: str | Path | None, identity: str | None = None) -> str | None:
    """Open a wording file for this process, and return its identity; None for our own words.

    Returned for each path, with no identity wanted:

    - ``"mine.toml"``: ``"mine@1a2b3c4d"``, the file's name and a hash of its content;
    - ``"mine@1a2b3c4d"``, if it is open in this process: the same;
    - ``"train"`` or ``"test"``, a pool of our own words: the same;
    - None: None, for all of our own words.

    A worker of a run also passes the identity that its episodes need, so that a file that has
    changed meanwhile is refused.

    Args:
        path: the file, an open identity, a pool, or None; see above.
        identity: the wordings that are wanted, an identity or a pool; None for those of `path`.

    Raises:
        InvalidValueError: the file cannot be read, is invalid, or is not the one that is wanted.
    """
    if identity in _OPEN:
        return identity  # it is open already, whatever the path
    # A pool of our own words needs no file; if one is wanted, the path does not matter.
    if path in POOLS or identity in POOLS:
        return str(identity or path)
    if path is None and identity is None:
        return None
    if path is None:
        raise InvalidValueError(f"The wordings {identity} need their file; none was given.")
    wordings = _OPEN.get(str(path))
    if wordings is None:
        wordings = read_wordings(path)
    if identity not in (None, wordings.identity):
        raise InvalidValueError(
            f"The wording file {str(path)!r} holds {wordings.identity}, but the episodes need "
            f"{identity}; put the file back, or start again in another folder."
        )
    return register_wordings(wordings)


def register_wordings(wordings: Wordings) -> str:
    """Make wordings known to this process, and return their identity: ``mine@1a2b3c4d``."""
    _OPEN[wordings.identity] = wordings
    return wordings.identity


def find_wordings(identity: str) -> Wordings:
    """Return wordings that this process has opened, by their identity.

    Raises:
        InvalidValueError: they are not open.
    """
    if identity not in _OPEN:
        raise InvalidValueError(
            f"The wordings {identity!r} are not open; call open_wordings with their file first."
        )
    return _OPEN[identity]


def task_words(task: str, setting: str, wordings: str | None) -> TaskScenarios | None:
    """Return the commands and scenarios of a task for a setting; None if there are none.

    An open wording file comes before the file of the setting, and this one before the file of the
    task.

    Args:
        task: its name.
        setting: its name.
        wordings: the identity of open wordings; None, or a pool, for our own words.
    """
    identity = outside_words(wordings)
    if identity is None:
        return words_in(setting, task)
    return _with_ours(task, setting, identity)


@functools.cache
def _with_ours(task: str, setting: str, identity: str) -> TaskScenarios | None:
    """Return a wording file's words of a task, completed by our own; None if it lacks the task.

    Ours stand in for its commands if it has none at all, for each value that it does not state, and
    for each setting of which it has no scenario (text template).

    Args:
        task: its name.
        setting: its name.
        identity: of the wording file, which must be open.
    """
    ours = words_in(setting, task)
    theirs = find_wordings(identity).tasks.get(task)
    if ours is None or theirs is None:
        return theirs
    commands = theirs.commands if COMMANDS in theirs.own else ours.commands
    stated = dict(ours.stated)
    for field, text in theirs.stated.items():
        if field in theirs.own:
            stated[field] = text
    their_settings = {scenario.fields.setting for scenario in theirs.scenarios}
    scenarios = list(theirs.scenarios)
    for scenario in ours.scenarios:
        if scenario.fields.setting not in their_settings:
            scenarios.append(scenario)
    return replace(theirs, commands=commands, stated=stated, scenarios=scenarios)
