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
from typing import NamedTuple

from roboirg.core.errors import RoboIRGError
from roboirg.core.plain_text import clip_text

OUR_PACKAGES = ("roboirg", "roboirg_learn")
"""Their code is not the user's; their kinds of policies may read the simulator's state."""

MAX_CAUSE_LENGTH = 400
_ADDRESS = re.compile(r"0x[0-9a-fA-F]{6,}")
"""Where an object is in memory: another place in every process."""
_LIBRARY = re.compile(
    r"[\\/](site|dist)-packages[\\/]|<(?!frozen|string|stdin|python-input|ipython-input)"
)
"""Files that no user edits: of installed packages, or code that one has generated."""


class _Step(NamedTuple):
    """A step of a traceback."""

    frame: FrameType
    line: int


def one_line(error: BaseException) -> str:
    """Return an exception as one line: its kind, its message, and file and line of the user's code.

    ``ValueError: no such joint (lab/walk.py, line 12)``. Never raises, and gives the same text in
    every process: memory addresses are left out. To a key that an observation or a demonstration
    lacks, it adds those that are there. At most `MAX_CAUSE_LENGTH` characters; the place is kept
    whole as far as possible, the message is cut.
    """
    try:
        text = str(error)
    except BaseException:  # noqa: BLE001 - a policy's own exceptions may raise anything
        text = "its text cannot be read"
    where = ""
    with contextlib.suppress(Exception):  # their variables may raise anything, too
        step = _last_step(error)
        if step is not None:
            file = _from_import_path(step.frame.f_code.co_filename)
            where = f" ({file}, line {step.line})"
            text += _keys_there(error, step.frame)

    words = text
    if not isinstance(error, RoboIRGError):
        words = f"{type(error).__name__}: {text}"
    # Splitting a text of a hundred megabytes would take minutes.
    words = " ".join(words[: 10 * MAX_CAUSE_LENGTH].split())
    words = re.sub(_ADDRESS, "0x…", words).rstrip(": ")
    where = clip_text(where, MAX_CAUSE_LENGTH // 2)
    return clip_text(words, MAX_CAUSE_LENGTH - len(where)) + where


def is_of_others(error: BaseException) -> bool:
    """Return whether an exception comes from code of users: files of theirs, or their packages."""
    step = _last_step(error)
    return step is not None and _is_users(step.frame)


def _last_step(error: BaseException) -> _Step | None:
    """Return the last step of a traceback that is in the code of users, to name its file and line.

    Without any, it is the last step in the package that we called first. Steps in our own code and
    in Python's do not count; None if there are no others.
    """
    steps_outside = []
    for frame, line in traceback.walk_tb(error.__traceback__):
        if _package(frame) not in OUR_PACKAGES and not _is_python(frame.f_code.co_filename):
            steps_outside.append(_Step(frame, line))
    if not steps_outside:
        return None
    candidates = [step for step in steps_outside if _is_users(step.frame)]
    if not candidates:
        # Deeper packages, such as NumPy under PyTorch, are not what we called.
        called = _package(steps_outside[0].frame)
        candidates = [step for step in steps_outside if _package(step.frame) == called]
    return candidates[-1]


def _package(frame: FrameType) -> str:
    """Return the name of the package whose code runs in a frame."""
    return str(frame.f_globals.get("__name__")).partition(".")[0]


def _is_python(file: str) -> bool:
    """Return whether a file comes with Python, or is none, such as ``<string>``."""
    stdlib = sysconfig.get_path("stdlib")
    return file.startswith(("<frozen", "<string", stdlib)) and not _LIBRARY.search(file)


def _is_users(frame: FrameType) -> bool:
    """Return whether code is a user's: of no library, or of a package that extends ours."""
    return not _LIBRARY.search(frame.f_code.co_filename) or _package(frame) in _extensions()


@functools.cache
def _extensions() -> frozenset[str]:
    """Return the names of installed packages that have entry points in a group ``roboirg.…``.

    Looked up once; cached for the life of the process.
    """
    find = importlib.metadata.entry_points
    packages = set()
    for group in find().groups:
        if group.startswith("roboirg."):
            packages |= {entry.module.partition(".")[0] for entry in find(group=group)}
    return frozenset(packages)


def _from_import_path(file: str) -> str:
    """Return the path of a file from where it was imported, which other machines share.

    With ``/home/me`` on the import path, ``/home/me/lab/walk.py`` is ``lab/walk.py``. Of several
    folders that contain it, the innermost counts; without any, the path stays as it is.
    """
    longest = ""
    for folder in sys.path:
        root = os.path.join(os.path.abspath(folder), "")  # noqa: PTH100, PTH118
        if file.startswith(root) and len(root) > len(longest):
            longest = root
    return file.removeprefix(longest)


def _keys_there(error: BaseException, frame: FrameType) -> str:
    """Return words with the keys that exist, for a KeyError of an observation or a demonstration.

    For ``observation["front"]``: ``"; the observation has front_rgb, gripper, …"``. Looks among the
    local variables of the frame that raised the error; empty if there is no such mapping.
    """
    if not isinstance(error, KeyError):
        return ""
    for value in frame.f_locals.values():
        # Both have joint positions; only an observation has an instruction.
        is_ours = isinstance(value, Mapping) and "joint_positions" in value
        if is_ours and error.args[0] not in value:
            kind = "observation" if "instruction" in value else "demonstration"
            return f"; the {kind} has {', '.join(sorted(value))}"
    return ""
