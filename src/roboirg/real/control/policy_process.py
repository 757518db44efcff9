"""Run a policy apart from the control loop: in a thread or in its own process.

The loop sends a request and polls for the reply, so it never waits longer than it wants.
`PolicyServiceLoop` handles the requests, in another thread (privileged policies, which read the
twin's state) or in another process (all others).
"""

from __future__ import annotations

import contextlib
import json
import multiprocessing
import queue
import signal
import threading
from collections.abc import Callable, Mapping
from multiprocessing.connection import Connection
from typing import TYPE_CHECKING, Any, NamedTuple, Protocol

from roboirg.core.errors import MissingDependencyError, RenderDeviceError
from roboirg.evaluation.episode_errors import EpisodeError, attribute_errors, one_line
from roboirg.policies.base import Policy, PrivilegedPolicy
from roboirg.policies.loading import make_policy
from roboirg.real.control.action_chunks import ChunkedPolicy
from roboirg.records.record import ErrorKind

if TYPE_CHECKING:
    from roboirg.envs.environment import RoboIRGEnv

STOP_WAIT_S = 2.0
"""Given to a process to end by itself before it is killed."""


class PolicyReply(NamedTuple):
    """What came of a request.

    Attributes:
        value: the answer; None if it failed.
        latency_s: what the policy says it took; counts only where time stands still meanwhile.
        fault: kind, words and traceback, if it failed.
    """

    value: Any = None
    latency_s: float = 0.0
    fault: tuple[ErrorKind, str, str] | None = None

    def checked(self) -> Any:  # noqa: ANN401 - whatever was asked for
        """The value.

        Raises:
            Fault: there is none.
        """
        if self.fault is not None:
            raise EpisodeError(*self.fault)
        return self.value


class PolicyServiceLoop:
    """Holds a policy and does what is asked of it."""

    def __init__(self) -> None:
        self._policy: Policy | None = None
        self._scene: contextlib.AbstractContextManager[object] = contextlib.nullcontext()

    def handle(self, what: str, *args: Any) -> PolicyReply:  # noqa: ANN401
        """Do one of ``make``, ``attach``, ``reset``, ``act`` and ``close``."""
        try:
            with attribute_errors("policy"):
                value = getattr(self, f"_{what}")(*args)
        except EpisodeError as fault:
            return PolicyReply(fault=(fault.kind, str(fault), fault.details))
        except (MissingDependencyError, RenderDeviceError) as error:
            return PolicyReply(fault=("policy", one_line(error), ""))
        return PolicyReply(value, float(getattr(self._policy, "latency_s", 0.0)))

    def _make(self, spec: str, seed: int) -> None:
        made = make_policy(spec, seed)
        self._policy = ChunkedPolicy(made) if isinstance(made, PrivilegedPolicy) else made

    def _attach(self, env: RoboIRGEnv, lock: contextlib.AbstractContextManager[object]) -> None:
        self._scene = lock
        if isinstance(self._policy, PrivilegedPolicy):
            self._policy.attach(env)

    def _reset(self, instruction: str, demonstration: dict[str, Any]) -> dict[str, Any]:
        policy = self._held()
        policy.reset(instruction, demonstration)
        # As a reader of the record will find it.
        said: dict[str, Any] = json.loads(json.dumps(dict(getattr(policy, "metadata", {}))))
        return said

    def _act(self, observation: Any) -> Any:  # noqa: ANN401
        with self._scene:  # which must not change while somebody plans in it
            return self._held().act(observation)

    def _close(self) -> dict[str, float]:
        policy, self._policy = self._policy, None
        usage: Mapping[str, float] = getattr(policy, "usage", dict)()
        getattr(policy, "close", lambda: None)()
        return {str(name): float(cost) for name, cost in usage.items()}

    def _held(self) -> Policy:
        if self._policy is None:
            raise RuntimeError("there is no policy yet")
        return self._policy


class PolicyHost(Protocol):
    """Where a policy works."""

    def ask(self, what: str, *args: Any) -> None:  # noqa: ANN401
        """Have something done; `answer` tells when it is."""

    def answer(self, timeout_s: float) -> PolicyReply | None:
        """The reply to what was asked, if there is one within that time."""

    def death(self) -> str | None:
        """How it died, if it did."""

    def close(self) -> None:
        """Give it up, whatever it is doing."""


class ThreadHost:
    """A policy in a thread of this process.

    A thread cannot be killed: one that is given up ends by itself, or with the process.

    Attributes:
        shares_scene: it can be handed the twin's environment.
    """

    shares_scene = True

    def __init__(self) -> None:
        self._courier = _RequestThread(PolicyServiceLoop().handle)

    def ask(self, what: str, *args: Any) -> None:  # noqa: ANN401
        """Have something done."""
        self._courier.requests.put((what, *args))

    def answer(self, timeout_s: float) -> PolicyReply | None:
        """The reply, if there is one within that time."""
        return self._courier.answer(timeout_s)

    def death(self) -> str | None:
        """Threads do not die of a policy's errors."""
        return None

    def close(self) -> None:
        """No more requests."""
        self._courier.requests.put(None)


class ProcessHost:
    """A policy in a process of its own, which is started anew with the host."""

    def __init__(self) -> None:
        context = multiprocessing.get_context("spawn")
        self._connection, theirs = context.Pipe()
        self.process = context.Process(target=_serve, args=(theirs,), daemon=True)
        self.process.start()
        theirs.close()
        # Whoever does not read makes the writer wait: so it is the courier who talks to it.
        self._courier = _RequestThread(self._talk)

    def ask(self, what: str, *args: Any) -> None:  # noqa: ANN401
        """Have something done."""
        self._courier.requests.put((what, *args))

    def answer(self, timeout_s: float) -> PolicyReply | None:
        """The reply, if there is one within that time."""
        return self._courier.answer(timeout_s)

    def death(self) -> str | None:
        """How the process died, if it did."""
        code = self.process.exitcode
        if code is None:
            return None
        return f"its process died (signal {-code})" if code < 0 else f"its process ended ({code})"

    def close(self) -> None:
        """End the process, by force if it has to be."""
        self._courier.requests.put(None)
        self.process.join(0.0)
        if self.process.is_alive():
            self.process.terminate()
            self.process.join(STOP_WAIT_S)
        if self.process.is_alive():
            self.process.kill()
            self.process.join()

    def _talk(self, what: str, *args: Any) -> PolicyReply:  # noqa: ANN401
        try:
            self._connection.send((what, *args))
            reply: PolicyReply = self._connection.recv()
        except (EOFError, OSError):
            self.process.join(STOP_WAIT_S)
            return PolicyReply(fault=("policy", self.death() or "its process went away", ""))
        return reply


class _RequestThread:
    """A thread that takes requests to a desk and brings the replies."""

    def __init__(self, handle: Callable[..., PolicyReply]) -> None:
        self.requests: queue.SimpleQueue[tuple[Any, ...] | None] = queue.SimpleQueue()
        self._replies: queue.SimpleQueue[PolicyReply] = queue.SimpleQueue()
        self._handle = handle
        threading.Thread(target=self._work, name="policy", daemon=True).start()

    def answer(self, timeout_s: float) -> PolicyReply | None:
        """The next reply, if there is one within that time."""
        try:
            return self._replies.get(timeout=max(timeout_s, 0.0))
        except queue.Empty:
            return None

    def _work(self) -> None:
        while (request := self.requests.get()) is not None:
            self._replies.put(self._handle(*request))


def _serve(connection: Connection) -> None:
    """What the process does: answer until nobody asks any more."""
    # Ctrl-C is for the loop, which stops the arm and then this.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    desk = PolicyServiceLoop()
    while True:
        try:
            request = connection.recv()
            reply = desk.handle(*request)
            connection.send(reply)
        except (EOFError, OSError):
            return
