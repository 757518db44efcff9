"""One sentence for any exception, with the place in the code of others where it was raised."""

from __future__ import annotations

import contextlib
import functools
import importlib.metadata
import os
import re
import sys
import sysconfig
import traceback
from collections.abc import Mapping
from types import FrameType

from roboirg.core.errors import RoboIRGError
from roboirg.core.plain_text import clip_text

OUR_PACKAGES = "roboirg", "roboirg_learn"
"""Their code is not the user's; their kinds of policies may read the simulator's state."""

MAX_CAUSE_LENGTH = 400
_LIBRARY = re.compile(
    r"[\\/](site|dist)-packages[\\/]|<(?!frozen|string|stdin|python-input|ipython-input)"
)
"""Files that no user edits: of installed packages, or code that one has generated."""


def one_line(error: BaseException) -> str:
    """Return an exception as one line: its kind, its message, and file and line of the user's code.

    It is the same in every process. To a key that an observation or a demonstration lacks, it adds
    those that are there.
    """
    try:
        text = str(error)
    except BaseException:  # noqa: BLE001 - a policy's own exceptions may raise anything
        text = "its text cannot be read"
    where = ""
    with contextlib.suppress(Exception):  # their variables may raise anything, too
        if (step := _last_step(error)) is not None:
            frame, line = step
            where = f" ({_from_import_path(frame.f_code.co_filename)}, line {line})"
            text += _keys_there(error, frame)
    words = text if isinstance(error, RoboIRGError) else f"{type(error).__name__}: {text}"
    # Splitting a text of a hundred megabytes would take minutes.
    words = " ".join(words[: 10 * MAX_CAUSE_LENGTH].split())
    words = re.sub(r"0x[0-9a-fA-F]{6,}", "0x…", words).rstrip(": ")
    where = clip_text(where, MAX_CAUSE_LENGTH // 2)
    return clip_text(words, MAX_CAUSE_LENGTH - len(where)) + where


def is_of_others(error: BaseException) -> bool:
    """Return whether an exception comes from code of users: files of theirs, or their packages."""
    step = _last_step(error)
    return step is not None and _is_users(step[0])


def _last_step(error: BaseException) -> tuple[FrameType, int] | None:
    """Return frame and line of the last step in code of users; else in what we called first."""
    theirs = [
        (frame, line)
        for frame, line in traceback.walk_tb(error.__traceback__)
        if _package(frame) not in OUR_PACKAGES and not _is_python(frame.f_code.co_filename)
    ]
    users = [one for one in theirs if _is_users(one[0])]
    found = users or [one for one in theirs if _package(one[0]) == _package(theirs[0][0])]
    return found[-1] if found else None


def _package(frame: FrameType) -> str:
    return str(frame.f_globals.get("__name__")).partition(".")[0]


def _is_python(file: str) -> bool:
    """Return whether a file comes with Python, or is none."""
    stdlib = sysconfig.get_path("stdlib")
    return file.startswith(("<frozen", "<string", stdlib)) and not _LIBRARY.search(file)


def _is_users(frame: FrameType) -> bool:
    """Return whether a file is not of a library, or its package adds something to ours."""
    return not _LIBRARY.search(frame.f_code.co_filename) or _package(frame) in _extensions()


@functools.cache
def _extensions() -> frozenset[str]:
    """Return the installed packages that add something to ours."""
    find = importlib.metadata.entry_points
    groups = (find(group=one) for one in find().groups if one.startswith("roboirg."))
    return frozenset(entry.module.partition(".")[0] for group in groups for entry in group)


def _from_import_path(file: str) -> str:
    """Return the path of a file from where it was imported, which other machines share."""
    roots = (os.path.join(os.path.abspath(one), "") for one in sys.path)  # noqa: PTH100, PTH118
    return file.removeprefix(max(filter(file.startswith, roots), key=len, default=""))


def _keys_there(error: BaseException, frame: FrameType) -> str:
    """Return the keys of an observation or a demonstration in a frame that lacks an error's key."""
    if isinstance(error, KeyError):
        for value in frame.f_locals.values():
            is_ours = isinstance(value, Mapping) and "joint_positions" in value
            if is_ours and error.args[0] not in value:
                kind = "observation" if "instruction" in value else "demonstration"
                return f"; the {kind} has {', '.join(sorted(value))}"
    return ""
