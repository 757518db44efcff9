"""File lock that gives one episode exclusive use of a stateful policy server.

An MME-VLA server has one memory for all its connections: two episodes at once would corrupt each
other unnoticed. So an episode locks the server's address in the kernel; the lock ends with the
process that holds it, however that ends. Locks hold among the processes of one user on one
computer.
"""

from __future__ import annotations

import fcntl
import logging
import os
import tempfile
import threading
import time
from collections.abc import Sequence
from pathlib import Path

import platformdirs

from roboirg.core.errors import PolicyConnectionError, PolicyTimeoutError
from roboirg.core.waiting import waiting
from roboirg.policies.remote.endpoints import Endpoint

_PAUSE = 0.05
"""Seconds between two attempts to lock a server."""

_log = logging.getLogger(__name__)
_held: dict[Path, int] = {}
"""Lock files of the servers this process holds exclusively, and the thread that took each."""


class ServerLock:
    """A lock on a server, held until `release`.

    Args:
        endpoint: the server.
        path: the lock file.
        descriptor: of the open lock file.
        shared: whether other episodes may use the server too.

    Attributes:
        endpoint: the server.
    """

    def __init__(self, endpoint: Endpoint, path: Path, descriptor: int, *, shared: bool) -> None:
        self.endpoint = endpoint
        self._descriptor: int | None = descriptor
        self._path, self._shared = path, shared
        if not shared:
            _held[path] = threading.get_ident()

    def release(self) -> None:
        """Unlock the server; repeated calls do nothing."""
        if self._descriptor is not None:
            descriptor, self._descriptor = self._descriptor, None
            if not self._shared:
                _held.pop(self._path, None)
            os.close(descriptor)


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
    lock = _try_each(order, folder, shared=shared)
    if lock is not None:
        return lock
    with waiting(f"a free server: {_listed(endpoints)}", is_queue=True):
        return _wait_for_lock(endpoints, folder, wait, shared=shared)


def _wait_for_lock(
    endpoints: Sequence[Endpoint], folder: Path, wait: float, *, shared: bool
) -> ServerLock:
    paths = [_path(endpoint, folder) for endpoint in endpoints]
    deadline = time.monotonic() + wait
    _log.info("%s locked; this episode waits for up to %g s.", _names(endpoints), wait)
    while True:
        if all(_held.get(path) == threading.get_ident() for path in paths):
            raise PolicyConnectionError(
                f"{_names(endpoints)} locked by another policy of this thread; close() it."
            )
        if time.monotonic() >= deadline:
            raise PolicyTimeoutError(
                f"{_names(endpoints)} used by other episodes for {wait:g} s; give each worker a "
                "server of its own (host:8001,host:8002), use fewer workers, or raise wait=."
            )
        time.sleep(min(_PAUSE, max(0.0, deadline - time.monotonic())))
        lock = _try_each(endpoints, folder, shared=shared)
        if lock is not None:
            return lock


def _try_each(endpoints: Sequence[Endpoint], folder: Path, *, shared: bool) -> ServerLock | None:
    locks = (_try_lock(endpoint, folder, shared=shared) for endpoint in endpoints)
    return next((lock for lock in locks if lock is not None), None)


def lock_folder() -> Path:
    """Return the folder of this user's lock files, which exists.

    It is the same for all of a user's processes, so it is not the folder of a login session.
    """
    folder = platformdirs.user_cache_path("roboirgbench") / "servers"
    try:
        folder.mkdir(parents=True, exist_ok=True, mode=0o700)
    except OSError:  # no home, or not writable
        folder = Path(tempfile.gettempdir()) / f"roboirgbench-{os.getuid()}" / "servers"
        folder.mkdir(parents=True, exist_ok=True, mode=0o700)
    return folder


def _try_lock(endpoint: Endpoint, folder: Path, *, shared: bool) -> ServerLock | None:
    path = _path(endpoint, folder)
    descriptor = os.open(path, os.O_RDWR | os.O_CREAT, 0o600)
    try:
        # The file stays when the lock is released: removing it would be a race.
        fcntl.flock(descriptor, (fcntl.LOCK_SH if shared else fcntl.LOCK_EX) | fcntl.LOCK_NB)
    except BlockingIOError:
        os.close(descriptor)
        return None
    except OSError:
        os.close(descriptor)
        raise
    return ServerLock(endpoint, path, descriptor, shared=shared)


def _path(endpoint: Endpoint, folder: Path) -> Path:
    return folder / f"{endpoint.identity}.lock"


def _names(endpoints: Sequence[Endpoint]) -> str:
    names = _listed(endpoints)
    return f"Policy server {names} was" if len(endpoints) == 1 else f"Policy servers {names} were"


def _listed(endpoints: Sequence[Endpoint]) -> str:
    return ", ".join(map(str, endpoints))
