"""The open connections of a server: a limited number, each with a deadline.

A server of threads and one of coroutines keep their connections here. Every limit is one of
`ConnectionLimits`; a server gives what ends a connection.
"""

from __future__ import annotations

import errno
import threading
import time
from collections.abc import Callable
from typing import Generic, NamedTuple, TypeVar

OUT_OF_FILES = frozenset({errno.EMFILE, errno.ENFILE, errno.ENOBUFS, errno.ENOMEM})
"""Errors of ``accept`` that pass when other connections end."""

ConnectionType = TypeVar("ConnectionType")


class ConnectionLimits(NamedTuple):
    """What the clients of a server may use.

    Attributes:
        connections: number of connections at once. Another one takes the place of the one that
            has waited longest without ever completing a request; if there is none, it is refused.
        request_s: seconds for the head of a request, or for an opening handshake; also for a
            piece of a response to be taken in.
        body_s: seconds for the body of a request, or for a message.
        idle_s: seconds between two requests of a connection.
    """

    connections: int = 64
    request_s: float = 30.0
    body_s: float = 600.0
    idle_s: float = 1800.0


class ConnectionTable(Generic[ConnectionType]):
    """Keeps the connections of one server; for use by several threads.

    Args:
        limits: of the server.
        end: ends a connection at once; called while the table is locked.

    Attributes:
        limits: of the server.
    """

    def __init__(self, limits: ConnectionLimits, end: Callable[[ConnectionType], object]) -> None:
        self.limits = limits
        self._end = end
        self._lock = threading.Lock()
        # In the order in which they opened; None is no deadline.
        self._deadlines: dict[ConnectionType, float | None] = {}
        self._proven: set[ConnectionType] = set()

    def __len__(self) -> int:
        return len(self._deadlines)

    def add(self, connection: ConnectionType) -> bool:
        """Add a connection; returns False, and adds nothing, if there is no place for it."""
        with self._lock:
            if len(self._deadlines) >= self.limits.connections and not self._end_oldest():
                return False
            self._deadlines[connection] = time.monotonic() + self.limits.request_s
            return True

    def expect(self, connection: ConnectionType, seconds: float | None) -> None:
        """Give a connection a new deadline; None gives it all the time it takes."""
        with self._lock:
            if connection in self._deadlines:
                self._deadlines[connection] = None if seconds is None else _in(seconds)

    def prove(self, connection: ConnectionType) -> None:
        """Note that a connection has sent a whole request, so that no other takes its place."""
        with self._lock:
            if connection in self._deadlines:
                self._proven.add(connection)

    def is_proven(self, connection: ConnectionType) -> bool:
        """Return whether a connection has sent a whole request."""
        return connection in self._proven

    def discard(self, connection: ConnectionType) -> None:
        """Remove a connection that has ended; repeated calls do nothing."""
        with self._lock:
            self._remove(connection)

    def has(self, connection: ConnectionType) -> bool:
        """Return whether a connection is open and within its time."""
        return connection in self._deadlines

    def end_late(self) -> None:
        """End the connections whose deadline has passed."""
        now = time.monotonic()
        with self._lock:
            for connection, deadline in list(self._deadlines.items()):
                if deadline is not None and deadline < now:
                    self._remove(connection)
                    self._end(connection)

    def make_room(self) -> bool:
        """End the connection that has waited longest without a request; returns whether it did."""
        with self._lock:
            return self._end_oldest()

    def _end_oldest(self) -> bool:
        for connection in self._deadlines:
            if connection not in self._proven:
                self._remove(connection)
                self._end(connection)
                return True
        return False

    def _remove(self, connection: ConnectionType) -> None:
        self._deadlines.pop(connection, None)
        self._proven.discard(connection)


def _in(seconds: float) -> float:
    return time.monotonic() + seconds
