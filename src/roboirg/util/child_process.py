"""What supervised child processes have in common: they end with their parent and say how."""

from __future__ import annotations

import ctypes
import os
import signal
import sys

_PR_SET_PDEATHSIG = 1


def exit_with_parent(parent: int) -> None:
    """Let the kernel kill this process when its parent dies, even if it hangs in native code.

    The kernel means the parent's thread that started this process, so that thread must last.

    Args:
        parent: process id of the parent; this process exits if that is already dead.
    """
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGKILL)
    if os.getppid() != parent:
        os._exit(1)  # the parent died before the line above


def describe_exit(exit_code: int | None) -> str:
    """Return how a process ended, in words."""
    if exit_code is not None and exit_code < 0:
        return f"the process died of signal {-exit_code}"
    return f"the process ended with exit code {exit_code}"


def was_killed(exit_code: int | None) -> bool:
    """Return whether SIGKILL ended a process: not its own doing, but a user's or the kernel's."""
    return exit_code == -signal.SIGKILL
