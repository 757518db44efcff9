"""The policies' processes of a run, and the lines on which worlds ask for them."""

from __future__ import annotations

import contextlib
import socket
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import Any, NamedTuple, Self

from roboirg.core.policy_ref import PolicyRef
from roboirg.policies.by_name.key_variables import environment_for
from roboirg.runs.hosting.messages import Loss, receive_request, send
from roboirg.runs.hosting.policy_child import PolicyChild
from roboirg.tasks.splits.private_splits import SALT_VARIABLE

DEFAULT_BATCH = 16

_NO_PROCESS = Loss("infrastructure", "the policy's process could not be started")

Connect = Callable[[], socket.socket]
"""Returns a new line to a pool, for a process with worlds."""


@dataclass(frozen=True, slots=True)
class HostSettings:
    """How the policies of a run are hosted.

    Attributes:
        batch: most episodes that a policy is asked about together.
        devices: values of ``CUDA_VISIBLE_DEVICES``; each policy gets a process on each of them.
        variables: environment variables with secrets that every policy gets.
        keep_idle: whether policies stay while others play, as they take turns.
    """

    batch: int = DEFAULT_BATCH
    devices: tuple[str, ...] = ()
    variables: tuple[str, ...] = ()
    keep_idle: bool = False


@contextlib.contextmanager
def open_hosts(play: Any) -> Iterator[Connect | None]:  # noqa: ANN401 - what plays jobs
    """Open processes for policies (hosts) on this machine while the block runs.

    Args:
        play: plays jobs; it needs hosts if it has ``hosting`` settings.

    Yields:
        Returns a new line to the hosts when it is called; None if none are needed.
    """
    settings: HostSettings | None = getattr(play, "hosting", None)
    if settings is None:
        yield None
        return
    with HostPool(settings) as pool:
        yield pool.connect


class _Slot(NamedTuple):
    """What has a process of its own: a policy, on a device or on any."""

    policy: PolicyRef
    device: str | None


class HostPool:
    """Starts a process for each policy on each device when a world first asks for it; a context.

    Args:
        settings: how policies are hosted.
    """

    def __init__(self, settings: HostSettings) -> None:
        self._settings = settings
        self._children: dict[_Slot, PolicyChild] = {}
        self._lines: list[socket.socket] = []
        self._lock = threading.Lock()
        self._is_closed = False
        # The kernel ends a process with the thread that started it.
        self._starter = ThreadPoolExecutor(1, "policy starter")

    def connect(self) -> socket.socket:
        """Return a new line, on which `PolicyLine` asks for a process; no other process has it."""
        ours, theirs = socket.socketpair()
        self._lines.append(theirs)
        self.serve(ours)
        return theirs

    def serve(self, line: socket.socket) -> None:
        """Serve the world at the other end of a line, one episode after the other."""
        self._lines.append(line)
        threading.Thread(target=self._serve, args=(line,), name="hosted world", daemon=True).start()

    def close(self) -> None:
        """End the processes of all policies, and close all lines; worlds then see their ends."""
        with self._lock:
            self._is_closed = True
            children = list(self._children.values())
            self._children.clear()
        for line in self._lines:
            with contextlib.suppress(OSError):
                line.shutdown(socket.SHUT_RDWR)
        for child in children:
            child.end()
        for line in self._lines:
            line.close()
        self._starter.shutdown(wait=False)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_exception: object) -> None:
        self.close()

    def _serve(self, line: socket.socket) -> None:
        """Do what a world (a process with a simulator) asks for until it hangs up.

        For each episode it asks for the process of a policy, and passes the end of a line, which is
        given to that process. Later it may ask whether the process lives, or to kill it.
        """
        child: PolicyChild | None = None
        try:
            with contextlib.suppress(EOFError, OSError):
                while True:
                    request, passed = receive_request(line)
                    # With "open" a new episode begins, even if the last one was not ended.
                    if request.method in ("open", "leave"):
                        self._leave(child)
                        child = None
                    if passed is not None and request.policy is not None:
                        with passed, contextlib.suppress(OSError):  # there is no room for one
                            child = self._enter(request.policy, passed)
                    elif request.method == "loss":
                        send(line, _NO_PROCESS if child is None else child.loss())
                    elif request.method == "check":
                        send(line, None if child is None else child.check(request.limit_s))
                    elif request.method == "kill" and child is not None:
                        child.kill()
        finally:
            self._leave(child)
            line.close()

    def _leave(self, child: PolicyChild | None) -> None:
        """Note that a policy's process serves one world less; None for no process."""
        if child is not None:
            with self._lock:
                child.worlds -= 1

    def _enter(self, policy: PolicyRef, passed: socket.socket) -> PolicyChild:
        """Return the process that is to play one more episode of a policy.

        A policy has one process on each device; the one with the fewest episodes is chosen. Missing
        processes are started.

        Args:
            policy: of the episode.
            passed: end of the line to the episode's world, for the process.

        Raises:
            EOFError: the run is ending.
        """
        with self._lock:
            if self._is_closed:
                raise EOFError
            devices = self._settings.devices or (None,)
            children = [self._child(_Slot(policy, device)) for device in devices]
            if not self._settings.keep_idle:
                self._end_others(policy)
            child = min(children, key=lambda child: child.worlds)
            child.worlds += 1
        child.serve(passed, self._settings.batch)
        return child

    def _child(self, slot: _Slot) -> PolicyChild:
        """Return the process of a policy on a device; start it if there is none or it has died.

        The process gets no salt of private splits, which would give their scenes away.
        """
        child = self._children.get(slot)
        if child is None or child.is_over:
            environment = environment_for(slot.policy, self._settings.variables)
            environment.pop(SALT_VARIABLE, None)
            if slot.device is not None:
                environment["CUDA_VISIBLE_DEVICES"] = slot.device
            child = self._starter.submit(PolicyChild, environment).result()
            self._children[slot] = child
        return child

    def _end_others(self, policy: PolicyRef) -> None:
        """End the idle processes of other policies: a run plays one policy after the other."""
        for slot, child in tuple(self._children.items()):
            if slot.policy != policy and not child.worlds:
                del self._children[slot]
                threading.Thread(target=child.end, name="policy end", daemon=True).start()
