"""File lock that gives one episode exclusive use of a stateful policy server.

An MME-VLA server has one memory for all its connections: two episodes at once would corrupt each
other unnoticed. So an episode locks the server's address in the kernel; the lock ends with the
process that holds it, however that ends. Locks hold among the processes of one user on one
computer.
"""

from __future__ import annotations

import contextlib
import os
import threading
import time
from collections.abc import Sequence
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
    """Lock one of several servers as soon as one is free.

    Args:
        endpoints: the servers to choose from.
        wait: seconds to wait for one.
        shared: whether other episodes that also share may use the server meanwhile.
        folder: of the lock files; `lock_folder` by default.

    Raises:
        PolicyTimeoutError: none was free in time.
        PolicyConnectionError: this thread itself holds all of them.
    """
    folder = folder or lock_folder()
    # Processes start at different servers, which spreads those that share.
    start = os.getpid() % len(endpoints)
    order = [*endpoints[start:], *endpoints[:start]]
    if (lock := _lock_any(order, folder, shared=shared)) is not None:
        return lock
    names, end = ", ".join(map(str, endpoints)), time.monotonic() + wait
    if all((threading.get_ident(), endpoint.identity) in _held for endpoint in endpoints):
        raise PolicyConnectionError(f"Another policy of this thread uses {names}; close() it.")
    with waiting(f"a free server: {names}", is_queue=True):
        while time.monotonic() < end:
            time.sleep(min(_PAUSE, max(0.0, end - time.monotonic())))
            if (lock := _lock_any(order, folder, shared=shared)) is not None:
                return lock
    raise PolicyTimeoutError(
        f"Other episodes used {names} for {wait:g} s; give each worker a server of its own "
        "(host:8001,host:8002), use fewer workers, or raise wait=."
    )


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
    """Return a lock on the first server that is free."""
    for endpoint in endpoints:
        with contextlib.ExitStack() as stack:
            file = stack.enter_context((folder / f"{endpoint.identity}.lock").open("a"))
            if take_lock(file.fileno(), Path(file.name), shared=shared):
                stack.pop_all()
                _held[threading.get_ident(), endpoint.identity] = file
                return ServerLock(endpoint, file)
    return None
