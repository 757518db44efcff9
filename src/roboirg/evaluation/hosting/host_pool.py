"""The policy hosts of a run, and the door at which worlds ask for them."""

from __future__ import annotations

import contextlib
import secrets
import tempfile
import threading
from collections.abc import Iterator
from dataclasses import dataclass
from multiprocessing.connection import Client, Connection, Listener
from pathlib import Path
from typing import NamedTuple, Protocol, Self, TypeVar, runtime_checkable

from roboirg.core.errors import InvalidValueError
from roboirg.evaluation.hosting.payload import decode, encode
from roboirg.evaluation.hosting.policy_child import ChildLostError, PolicyChild
from roboirg.evaluation.hosting.policy_host import HostSession, PolicyHost, host_variables

RETRY_S = 0.25
"""How long to wait before a client is accepted after one that could not be."""
DEFAULT_BATCH = 16


@dataclass(frozen=True, slots=True)
class HostSettings:
    """How the policies of a run are hosted.

    Attributes:
        batch: most episodes that a policy is asked about together.
        devices: values of ``CUDA_VISIBLE_DEVICES``; each policy gets a process on each of them.
        policy_timeout_s: seconds that one call of a policy may take; None for no limit.

    Raises:
        InvalidValueError: the batch is less than 1.
    """

    batch: int = DEFAULT_BATCH
    devices: tuple[str, ...] = ()
    policy_timeout_s: float | None = None

    def __post_init__(self) -> None:
        if self.batch < 1:
            raise InvalidValueError(f"batch is {self.batch}; it must be at least 1.")


class HostAddress(NamedTuple):
    """Where a pool listens.

    Attributes:
        path: of its socket.
        key: proves that a client belongs to the run; policies do not know it.
    """

    path: str
    key: bytes


@runtime_checkable
class HostUser(Protocol):
    """A function that plays jobs and needs policy hosts, if it has settings for them."""

    @property
    def hosting(self) -> HostSettings | None:
        """How policies are hosted; None for policies in the world's process."""

    def with_hosts(self, hosts: HostAddress) -> Self:
        """Return a copy that asks these hosts."""


Playing = TypeVar("Playing")


@contextlib.contextmanager
def open_hosts(play: Playing) -> Iterator[Playing]:
    """Open the hosts that a function needs on this machine.

    Yields:
        The function with the hosts' address, or itself if it needs none.
    """
    if not isinstance(play, HostUser) or play.hosting is None:
        yield play
        return
    with HostPool(play.hosting) as pool:
        yield play.with_hosts(pool.address)


class HostPool:
    """Starts a host for each policy on each device when a world first asks for it; a context.

    Args:
        settings: how policies are hosted.

    Attributes:
        address: where worlds reach it.
    """

    def __init__(self, settings: HostSettings) -> None:
        self._settings = settings
        self._folder = tempfile.TemporaryDirectory(prefix="roboirg-")
        self.address = HostAddress(str(Path(self._folder.name) / "hosts"), secrets.token_bytes(32))
        self._listener = Listener(self.address.path, "AF_UNIX", backlog=128)
        self._hosts: dict[tuple[str, str | None], PolicyHost] = {}
        self._lock, self._closed = threading.Lock(), threading.Event()
        threading.Thread(target=self._accept, name="policy hosts", daemon=True).start()

    @property
    def pids(self) -> list[int]:
        """The process ids of the policies' processes."""
        return [child.pid for child in self._children()]

    def loss(self) -> ChildLostError | None:
        """Return how a policy's process died since the last call; None if all are alive."""
        return next(filter(None, (child.loss() for child in self._children())), None)

    def _children(self) -> list[PolicyChild]:
        with self._lock:
            children = [host.child for host in self._hosts.values()]
        return [child for child in children if child is not None]

    def close(self) -> None:
        """End all hosts."""
        self._closed.set()
        with contextlib.suppress(OSError):
            Client(self.address.path, "AF_UNIX").close()  # wakes the thread that accepts
        self._listener.close()
        with self._lock:
            hosts = list(self._hosts.values())
            self._hosts.clear()
        for host in hosts:
            host.join()
        self._folder.cleanup()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_exception: object) -> None:
        self.close()

    def _accept(self) -> None:
        while not self._closed.is_set():
            try:
                connection = self._listener.accept()
            except OSError:  # closed, or a client hung up
                self._closed.wait(RETRY_S)
                continue
            threading.Thread(
                target=self._serve, args=(connection,), name="hosted world", daemon=True
            ).start()

    def _serve(self, connection: Connection) -> None:
        """Carry out the calls of one episode until its world hangs up."""
        host, session = None, HostSession(connection)
        key = self.address.key
        with connection, contextlib.suppress(EOFError, OSError, ValueError):
            if not secrets.compare_digest(connection.recv_bytes(len(key)), key):
                return
            try:
                while True:
                    message = decode(connection.recv_bytes())
                    if message["method"] == "open":
                        session.alone = bool(message["alone"])
                        host = self._host_for(message["spec"], session)
                    if host is not None:
                        connection.send_bytes(encode(host.call(session, message)))
            finally:
                if host is not None:
                    host.leave(session)

    def _host_for(self, spec: str, session: HostSession) -> PolicyHost:
        """Return the host of a policy with the fewest episodes, and end what is not needed."""
        settings = self._settings
        with self._lock:
            for device in settings.devices or (None,):
                if (spec, device) not in self._hosts:
                    self._hosts[spec, device] = PolicyHost(
                        host_variables(device), settings.batch, settings.policy_timeout_s
                    )
            # A run plays one policy after the other: what has no episodes is over, most likely.
            for other, device in tuple(self._hosts):
                if other != spec and not self._hosts[other, device].sessions:
                    self._hosts.pop((other, device)).stop()
            chosen = min(
                (host for (name, _), host in self._hosts.items() if name == spec),
                key=lambda host: len(host.sessions),
            )
            chosen.sessions.add(session)
            return chosen
