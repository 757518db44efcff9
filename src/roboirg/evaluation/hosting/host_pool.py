"""The policy hosts of a run, and the lines on which worlds ask for them."""

from __future__ import annotations

import contextlib
import socket
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import Any, Self

from roboirg.core.policy_ref import PolicyRef
from roboirg.evaluation.hosting.messages import receive_calls, send
from roboirg.evaluation.hosting.policy_child import PolicyChild
from roboirg.evaluation.hosting.policy_host import HostSession, PolicyHost

DEFAULT_BATCH = 16

Connect = Callable[[], socket.socket]
"""Returns a new line to a pool, for a process with worlds."""


@dataclass(frozen=True, slots=True)
class HostSettings:
    """How the policies of a run are hosted.

    Attributes:
        batch: most episodes that a policy is asked about together.
        devices: values of ``CUDA_VISIBLE_DEVICES``; each policy gets a process on each of them.
        policy_timeout_s: seconds that one call of a policy may take; None for no limit.
    """

    batch: int = DEFAULT_BATCH
    devices: tuple[str, ...] = ()
    policy_timeout_s: float | None = None


@contextlib.contextmanager
def open_hosts(play: Any) -> Iterator[Connect | None]:  # noqa: ANN401 - what plays jobs
    """Open the hosts that a function needs on this machine, if it has ``hosting`` settings.

    Yields:
        What connects a process to them; None if it needs none.
    """
    settings: HostSettings | None = getattr(play, "hosting", None)
    if settings is None:
        yield None
        return
    with HostPool(settings) as pool:
        yield pool.connect


class HostPool:
    """Starts a host for each policy on each device when a world first asks for it; a context.

    Args:
        settings: how policies are hosted.
    """

    def __init__(self, settings: HostSettings) -> None:
        self._settings = settings
        self._hosts: dict[tuple[PolicyRef | None, str | None], PolicyHost] = {}
        self._lines: list[socket.socket] = []
        self._far_ends: list[socket.socket] = []
        self._lock, self._is_closed = threading.Lock(), False
        # The kernel ends a process with the thread that started it.
        self._starter = ThreadPoolExecutor(1, "policy starter")

    def connect(self) -> socket.socket:
        """Return a new line, on which `HostedPolicy` begins episodes; no other process has it."""
        ours, theirs = socket.socketpair()
        self._far_ends.append(theirs)
        self.serve(ours)
        return theirs

    def serve(self, line: socket.socket) -> None:
        """Serve the world at the other end of a line, one episode after the other."""
        self._lines.append(line)
        threading.Thread(target=self._serve, args=(line,), name="hosted world", daemon=True).start()

    @property
    def pids(self) -> list[int]:
        """The process ids of the policies' processes."""
        with self._lock:
            children = [host.child for host in self._hosts.values()]
        return [child.pid for child in children if child is not None]

    def close(self) -> None:
        """End all hosts, and close the lines that `connect` returned."""
        with self._lock:
            self._is_closed = True
            hosts = list(self._hosts.values())
            self._hosts.clear()
        for line in self._lines:
            with contextlib.suppress(OSError):
                line.shutdown(socket.SHUT_RDWR)
        for host in hosts:
            host.stop()
        for line in self._far_ends:
            line.close()
        self._starter.shutdown(wait=False)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_exception: object) -> None:
        self.close()

    def _serve(self, line: socket.socket) -> None:
        """Carry out the calls of a world until it hangs up."""
        host: PolicyHost | None = None
        with line:
            session = HostSession(line)
            try:
                with contextlib.suppress(EOFError, OSError):
                    while True:
                        (call,) = receive_calls(line)
                        if call.method == "open":
                            if host is not None:  # the world gave up the episode before
                                host.leave(session)
                            session = HostSession(line, call.alone)
                            host = self._host_for(call.policy, session)
                        if host is None:
                            return
                        send(line, host.call(session, call))
                        if not session.started:
                            host.leave(session)
            finally:
                if host is not None:
                    host.leave(session)

    def _host_for(self, policy: PolicyRef | None, session: HostSession) -> PolicyHost | None:
        """Return the host of a policy with the fewest episodes, and end what is not needed."""
        with self._lock:
            if self._is_closed:
                return None
            for device in self._settings.devices or (None,):
                if (policy, device) not in self._hosts:
                    self._hosts[policy, device] = self._new_host(device)
            # A run plays one policy after the other: what has no episodes is over, most likely.
            for other, device in tuple(self._hosts):
                if other != policy and not self._hosts[other, device].sessions:
                    over = self._hosts.pop((other, device))
                    threading.Thread(target=over.stop, name="policy end", daemon=True).start()
            chosen = min(
                (host for (name, _), host in self._hosts.items() if name == policy),
                key=lambda host: len(host.sessions),
            )
            chosen.sessions.add(session)
            return chosen

    def _new_host(self, device: str | None) -> PolicyHost:
        variables = {} if device is None else {"CUDA_VISIBLE_DEVICES": device}

        def start() -> PolicyChild:
            return self._starter.submit(PolicyChild, variables).result()

        return PolicyHost(start, self._settings.batch, self._settings.policy_timeout_s)
