"""A time limit for an exchange over sockets, however many reads and writes it takes.

The limits of sockets and of HTTP clients apply to one read or write, and begin again with every
byte that a peer sends or takes in.
"""

from __future__ import annotations

import contextlib
import socket
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from weakref import WeakSet

CHECKS = 20
"""Per time limit, which may be exceeded by the time between two checks."""
MAX_PAUSE = 1.0
"""Seconds between two checks."""


class SocketDeadline:
    """Shuts sockets down when an exchange over them takes too long, from a thread of its own.

    The thread polls, because starting a timer for each message costs more than sending two
    pictures.

    Args:
        shortest: seconds of the shortest limit.

    Attributes:
        passed: whether a limit was exceeded; the sockets cannot be used any more.
    """

    def __init__(self, shortest: float) -> None:
        self.passed = False
        self._sockets: WeakSet[socket.socket] = WeakSet()
        self._deadline: float | None = None
        self._lock = threading.Lock()
        self._closed = threading.Event()
        pause = min(shortest / CHECKS, MAX_PAUSE)
        threading.Thread(
            target=self._watch, args=(pause,), name="socket deadline", daemon=True
        ).start()

    def add(self, connection: socket.socket) -> None:
        """Watch a socket too."""
        with self._lock:
            self._sockets.add(connection)
            if self.passed:
                _shut_down(connection)

    @contextmanager
    def limit(self, seconds: float) -> Iterator[None]:
        """Limit the time of the block, which uses the sockets; limits do not nest."""
        with self._lock:
            self._deadline = time.monotonic() + seconds
        try:
            yield
        finally:
            with self._lock:
                self._deadline = None

    def abort(self) -> None:
        """Shut the sockets down now."""
        with self._lock:
            for connection in self._sockets:
                _shut_down(connection)

    def close(self) -> None:
        """End the thread; repeated calls do nothing."""
        self._closed.set()

    def _watch(self, pause: float) -> None:
        while not self._closed.wait(pause):
            with self._lock:
                if self._deadline is not None and time.monotonic() > self._deadline:
                    self.passed = True
                    for connection in self._sockets:
                        _shut_down(connection)


def _shut_down(connection: socket.socket) -> None:
    """Wake the thread that uses a socket, also one with TLS, whose state is left alone."""
    with contextlib.suppress(OSError):
        socket.socket.shutdown(connection, socket.SHUT_RDWR)
