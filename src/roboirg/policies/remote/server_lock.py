"""A server for oneself: whoever plays an episode with a server that remembers holds its lock.

One MME-VLA server has one memory for all its connections. Two episodes that used it at the same
time would disturb each other without either of them noticing. So an episode takes a lock of the
kernel for the server's address; it is gone with the process that held it, whatever ends that. The
locks are those of one user on one computer.
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

from roboirg.core.errors import MissingDependencyError, PolicyConnectionError, PolicyTimeoutError
from roboirg.policies.remote.endpoints import Endpoint

try:
    import platformdirs
except ImportError as error:
    raise MissingDependencyError(
        "Remote policies need platformdirs; install roboirgbench[remote]."
    ) from error

_PAUSE = 0.05
"""Seconds between two looks whether a server is free."""


_log = logging.getLogger(__name__)
_held: dict[Path, int] = {}
"""Lock files of the servers that this process has for itself, and which thread took them."""


class ServerLock:
    """The right to use a server, until it is released.

    Args:
        endpoint: the server.
        path: the lock file.
        number: its descriptor.
        shared: whether others may use the server as well.

    Attributes:
        endpoint: the server.
    """

    def __init__(self, endpoint: Endpoint, path: Path, number: int, *, shared: bool) -> None:
        self.endpoint = endpoint
        self._number: int | None = number
        self._path, self._shared = path, shared
        if not shared:
            _held[path] = threading.get_ident()

    def release(self) -> None:
        """Let others have the server; may be called again."""
        if self._number is not None:
            number, self._number = self._number, None
            if not self._shared:
                _held.pop(self._path, None)
            os.close(number)


def lock_server(
    endpoints: Sequence[Endpoint], *, wait: float, shared: bool = False, folder: Path | None = None
) -> ServerLock:
    """Get one of several servers, as soon as one is free.

    Args:
        endpoints: the servers to choose from.
        wait: seconds.
        shared: whether others that say the same may use the server meanwhile.
        folder: of the lock files; `lock_folder` by default.

    Raises:
        PolicyTimeoutError: none was free in time.
        PolicyConnectionError: this thread itself has all of them in use.
    """
    folder = folder or lock_folder()
    # Processes begin at different servers, which spreads those that share.
    start = os.getpid() % len(endpoints)
    order = [*endpoints[start:], *endpoints[:start]]
    deadline, told = time.monotonic() + wait, False
    while True:
        for endpoint in order:
            lease = _try(endpoint, folder, shared=shared)
            if lease is not None:
                return lease
        paths = [_path(endpoint, folder) for endpoint in endpoints]
        if all(_held.get(path) == threading.get_ident() for path in paths):
            raise PolicyConnectionError(
                f"{_names(endpoints)} taken by another policy that this thread made; close() it."
            )
        if time.monotonic() >= deadline:
            raise PolicyTimeoutError(
                f"{_names(endpoints)} used by other episodes for {wait:g} s; give each worker a "
                "server of its own (host:8001,host:8002), use fewer workers, or raise wait=."
            )
        if not told:
            told = True
            _log.info("%s taken; this episode waits for up to %g s.", _names(endpoints), wait)
        time.sleep(min(_PAUSE, max(0.0, deadline - time.monotonic())))


def lock_folder() -> Path:
    """Where this user's lock files are; it exists.

    The same for all of a user's processes, however they were started; so not the folder of a login.
    """
    folder = platformdirs.user_cache_path("roboirgbench") / "servers"
    try:
        folder.mkdir(parents=True, exist_ok=True, mode=0o700)
    except OSError:  # no home, or none that can be written
        folder = Path(tempfile.gettempdir()) / f"roboirgbench-{os.getuid()}" / "servers"
        folder.mkdir(parents=True, exist_ok=True, mode=0o700)
    return folder


def _try(endpoint: Endpoint, folder: Path, *, shared: bool) -> ServerLock | None:
    path = _path(endpoint, folder)
    number = os.open(path, os.O_RDWR | os.O_CREAT, 0o600)
    try:
        # The file stays when the lock goes: to remove it would be a race.
        fcntl.flock(number, (fcntl.LOCK_SH if shared else fcntl.LOCK_EX) | fcntl.LOCK_NB)
    except BlockingIOError:
        os.close(number)
        return None
    except OSError:
        os.close(number)
        raise
    return ServerLock(endpoint, path, number, shared=shared)


def _path(endpoint: Endpoint, folder: Path) -> Path:
    return folder / f"{endpoint.identity}.lock"


def _names(endpoints: Sequence[Endpoint]) -> str:
    names = ", ".join(map(str, endpoints))
    return f"Policy server {names} was" if len(endpoints) == 1 else f"Policy servers {names} were"
