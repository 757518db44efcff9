"""Run a policy apart from the control loop: in a thread or in its own process.

The loop sends a request and polls for the reply, so it never waits longer than it wants.
Privileged policies read the twin's state, so they run in a thread; all others run in a process.
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

EXIT_WAIT_S = 2.0
"""How long a process may take to exit before it is killed."""


class PolicyReply(NamedTuple):
    """The reply to a request.

    Attributes:
        value: returned by the policy; None if it failed.
        latency_s: reported by the policy; used where time stands still while it computes.
        error: kind, message and traceback, if it failed.
    """

    value: Any = None
    latency_s: float = 0.0
    error: tuple[ErrorKind, str, str] | None = None

    def result(self) -> Any:  # noqa: ANN401 - depends on the request
        """Return the value.

        Raises:
            EpisodeError: the request failed.
        """
        if self.error is not None:
            raise EpisodeError(*self.error)
        return self.value


class PolicyDispatcher:
    """Holds a policy and carries out requests."""

    def __init__(self) -> None:
        self._policy: Policy | None = None
        self._scene_lock: contextlib.AbstractContextManager[object] = contextlib.nullcontext()

    def handle(self, method: str, *args: Any) -> PolicyReply:  # noqa: ANN401
        """Carry out ``make``, ``attach``, ``reset``, ``act`` or ``close``."""
        try:
            with attribute_errors("policy"):
                value = getattr(self, f"_{method}")(*args)
        except EpisodeError as error:
            return PolicyReply(error=(error.kind, str(error), error.details))
        except (MissingDependencyError, RenderDeviceError) as error:
            return PolicyReply(error=("policy", one_line(error), ""))
        return PolicyReply(value, float(getattr(self._policy, "latency_s", 0.0)))

    def _make(self, spec: str, seed: int) -> None:
        made = make_policy(spec, seed)
        self._policy = ChunkedPolicy(made) if isinstance(made, PrivilegedPolicy) else made

    def _attach(self, env: RoboIRGEnv, lock: contextlib.AbstractContextManager[object]) -> None:
        self._scene_lock = lock
        if isinstance(self._policy, PrivilegedPolicy):
            self._policy.attach(env)

    def _reset(self, instruction: str, demonstration: dict[str, Any]) -> dict[str, Any]:
        policy = self._require_policy()
        policy.reset(instruction, demonstration)
        # Through JSON, as in the record.
        metadata: dict[str, Any] = json.loads(json.dumps(dict(getattr(policy, "metadata", {}))))
        return metadata

    def _act(self, observation: Any) -> Any:  # noqa: ANN401
        with self._scene_lock:  # the scene must not change while a policy plans in it
            return self._require_policy().act(observation)

    def _close(self) -> dict[str, float]:
        policy, self._policy = self._policy, None
        usage: Mapping[str, float] = getattr(policy, "usage", dict)()
        getattr(policy, "close", lambda: None)()
        return {str(name): float(cost) for name, cost in usage.items()}

    def _require_policy(self) -> Policy:
        if self._policy is None:
            raise RuntimeError("no policy has been made")
        return self._policy


class PolicyWorker(Protocol):
    """A thread or process that runs a policy.

    Attributes:
        shares_scene: whether the policy runs in this process, so that it can read the twin's state.
    """

    shares_scene: bool

    def send(self, method: str, *args: Any) -> None:  # noqa: ANN401
        """Send a request."""

    def receive(self, timeout_s: float) -> PolicyReply | None:
        """Return the next reply; None if there is none within that time."""

    def exit_reason(self) -> str | None:
        """Return how the worker died; None while it is alive."""

    def close(self) -> None:
        """Stop the worker."""


class PolicyThread:
    """A privileged policy in a thread of this process, where it can read the twin's state.

    The world stands still while it plans: it holds the twin's lock. A thread cannot be killed: a
    closed one ends after its last request, or with the process.
    """

    shares_scene = True

    def __init__(self) -> None:
        self._thread = _RequestThread(PolicyDispatcher().handle)

    def send(self, method: str, *args: Any) -> None:  # noqa: ANN401
        """Send a request."""
        self._thread.requests.put((method, *args))

    def receive(self, timeout_s: float) -> PolicyReply | None:
        """Return the next reply; None if there is none within that time."""
        return self._thread.receive(timeout_s)

    def exit_reason(self) -> str | None:
        """Return None: a policy's errors do not end the thread."""
        return None

    def close(self) -> None:
        """Let the thread end."""
        self._thread.requests.put(None)


class PolicyProcess:
    """A policy in a process of its own."""

    shares_scene = False

    def __init__(self) -> None:
        context = multiprocessing.get_context("spawn")
        self._connection, child_connection = context.Pipe()
        self.process = context.Process(target=_serve, args=(child_connection,), daemon=True)
        self.process.start()
        child_connection.close()
        # A thread writes to the pipe: it blocks while the process does not read.
        self._thread = _RequestThread(self._exchange)

    def send(self, method: str, *args: Any) -> None:  # noqa: ANN401
        """Send a request."""
        self._thread.requests.put((method, *args))

    def receive(self, timeout_s: float) -> PolicyReply | None:
        """Return the next reply; None if there is none within that time."""
        return self._thread.receive(timeout_s)

    def exit_reason(self) -> str | None:
        """Return how the process died; None while it is alive."""
        code = self.process.exitcode
        if code is None:
            return None
        return f"its process died (signal {-code})" if code < 0 else f"its process ended ({code})"

    def close(self) -> None:
        """End the process, by force if it does not exit."""
        self._thread.requests.put(None)
        self.process.join(0.0)
        if self.process.is_alive():
            self.process.terminate()
            self.process.join(EXIT_WAIT_S)
        if self.process.is_alive():
            self.process.kill()
            self.process.join()

    def _exchange(self, method: str, *args: Any) -> PolicyReply:  # noqa: ANN401
        try:
            self._connection.send((method, *args))
            reply: PolicyReply = self._connection.recv()
        except (EOFError, OSError):
            self.process.join(EXIT_WAIT_S)
            return PolicyReply(error=("policy", self.exit_reason() or "its process exited", ""))
        return reply


class _RequestThread:
    """A thread that passes requests to a handler and queues the replies."""

    def __init__(self, handle: Callable[..., PolicyReply]) -> None:
        self.requests: queue.SimpleQueue[tuple[Any, ...] | None] = queue.SimpleQueue()
        self._replies: queue.SimpleQueue[PolicyReply] = queue.SimpleQueue()
        self._handle = handle
        threading.Thread(target=self._run, name="policy", daemon=True).start()

    def receive(self, timeout_s: float) -> PolicyReply | None:
        """Return the next reply; None if there is none within that time."""
        try:
            return self._replies.get(timeout=max(timeout_s, 0.0))
        except queue.Empty:
            return None

    def _run(self) -> None:
        while (request := self.requests.get()) is not None:
            self._replies.put(self._handle(*request))


def _serve(connection: Connection) -> None:
    """Answer requests until the connection closes; runs in the policy's process."""
    # Ctrl-C is for the loop, which stops the arm and then this process.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    dispatcher = PolicyDispatcher()
    while True:
        try:
            request = connection.recv()
            connection.send(dispatcher.handle(*request))
        except (EOFError, OSError):
            return
