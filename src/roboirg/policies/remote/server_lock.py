"""File lock that gives one episode exclusive use of a stateful policy server.

An MME-VLA server has one memory for all its connections: two episodes at once would corrupt each
other unnoticed. So an episode locks the server's address in the kernel; the lock ends with the
process that holds it, however that ends. Locks hold among the processes of one user on one
computer.
"""

from __future__ import annotations

import contextlib
import functools
import os
import threading
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import IO, NamedTuple
from weakref import WeakValueDictionary

from roboirg.core.errors import PolicyConnectionError, PolicyTimeoutError
from roboirg.core.waiting import waiting
from roboirg.policies.remote.endpoints import Endpoint
from roboirg.util.atomic_write import take_lock
from roboirg.util.user_folders import temporary_folder, user_folder

_PAUSE = 0.05
"""Seconds between two attempts to lock a server."""
_held: WeakValueDictionary[tuple[int, str], IO[str]] = WeakValueDictionary()
"""Files of the locks of this process, by the thread that took them and the server."""


class ServerLock(NamedTuple):
    """A lock on a server, held until its file is closed.

    Attributes:
        endpoint: the server.
        file: stays when it is closed: removing it would be a race.
    """

    endpoint: Endpoint
    file: IO[str]


def lock_server(
    endpoints: Sequence[Endpoint], *, wait: float, shared: bool = False, folder: Path | None = None
) -> ServerLock:
    """Lock one of several servers as soon as one is free, for all processes of this user.

    Args:
        endpoints: the servers to choose from.
        wait: seconds to wait for one.
        shared: whether other episodes that also share may use the server meanwhile.
        folder: of the lock files; `lock_folder` by default.

    Raises:
        PolicyTimeoutError: none was free in time.
        PolicyConnectionError: this thread itself holds all of them.
    """
    # Processes start at different servers, which spreads those that share.
    start = os.getpid() % len(endpoints)
    order = [*endpoints[start:], *endpoints[:start]]
    attempt = functools.partial(_lock_any, order, folder or lock_folder(), shared=shared)
    lock = attempt()
    names = ", ".join(map(str, endpoints))
    if lock is None:
        if all(_is_held(endpoint) for endpoint in endpoints):
            raise PolicyConnectionError(f"Another policy of this thread uses {names}; close() it.")
        with waiting(f"a free server: {names}", is_queue=True):
            lock = _attempt_again(attempt, wait)
    if lock is None:
        raise PolicyTimeoutError(
            f"Other episodes used {names} for {wait:g} s; give each worker a server of its own "
            "(host:8001,host:8002), use fewer workers, or raise wait=."
        )
    return lock


def _attempt_again(attempt: Callable[[], ServerLock | None], seconds: float) -> ServerLock | None:
    """Attempt to lock a server until it succeeds; return None if it does not within the time."""
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        left = end - time.monotonic()
        time.sleep(min(_PAUSE, max(0.0, left)))
        lock = attempt()
        if lock is not None:
            return lock
    return None


def _is_held(endpoint: Endpoint) -> bool:
    """Return whether this thread holds a server, so that it would wait for itself."""
    return (threading.get_ident(), endpoint.identity) in _held


def lock_folder() -> Path:
    """Return the folder of this user's lock files, which exists.

    It is the same for all of a user's processes, so it is not the folder of a login session.
    """
    folder = user_folder("cache", below="servers")
    try:
        folder.mkdir(parents=True, exist_ok=True, mode=0o700)
    except OSError:  # not writable
        folder = temporary_folder() / "servers"
        folder.mkdir(parents=True, exist_ok=True, mode=0o700)
    return folder


def _lock_any(endpoints: Sequence[Endpoint], folder: Path, *, shared: bool) -> ServerLock | None:
    """Return a lock on the first server whose lock file can be locked; None if none is free.

    Does not wait. The lock lasts as long as its file is open.
    """
    for endpoint in endpoints:
        with contextlib.ExitStack() as stack:
            path = folder / f"{endpoint.identity}.lock"
            file = stack.enter_context(path.open("a"))
            if take_lock(file.fileno(), path, shared=shared):
                stack.pop_all()  # the file stays open, as closing it would unlock it
                _held[threading.get_ident(), endpoint.identity] = file
                return ServerLock(endpoint, file)
    return None
