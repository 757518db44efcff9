"""Refuses to draw in a process that was forked from one that had drawn, where it would hang."""

from __future__ import annotations

import os

from roboirg.core.errors import RoboIRGError

_drawing_processes: set[int] = set()
"""This process, if it has drawn; after a fork, the parent."""


def check_drawing_process() -> None:
    """Remember that this process draws.

    Raises:
        RoboIRGError: a process from which it was forked had drawn.
    """
    if _drawing_processes - {os.getpid()}:
        raise RoboIRGError(
            "This process was forked from one that had drawn pictures, and the renderer's threads "
            "do not survive that; start it otherwise, as with AsyncVectorEnv(..., "
            "context='spawn') or roboirg.make_vec."
        )
    _drawing_processes.add(os.getpid())
