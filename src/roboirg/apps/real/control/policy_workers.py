"""Run a policy apart from the control loop: in a thread or in its own process.

The loop sends a request and polls for the reply, so it never waits longer than it wants.
Privileged policies read the twin's state, so they run in a thread; all others run in a process.
"""

from __future__ import annotations

import contextlib
import functools
import queue
import threading
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from roboirg.apps.real.control.robot import HORIZON
from roboirg.core.errors import EndOfRunError
from roboirg.core.inference_facts import InferenceFacts, inference_facts
from roboirg.core.observations import Demonstration, Observation
from roboirg.evaluation.episode_errors import (
    EpisodeError,
    EpisodeLostError,
    attribute_errors,
    one_line,
)
from roboirg.evaluation.hosting.host_pool import HostPool, HostSettings
from roboirg.evaluation.hosting.hosted_policy import HostedPolicy
from roboirg.evaluation.policy_calls import policy_metadata
from roboirg.evaluation.records.record import ErrorKind
from roboirg.policies.by_name.loading import make_policy
from roboirg.policies.contract.base import Policy, PrivilegedPolicy
from roboirg.policies.contract.policy_needs import PolicyNeeds

if TYPE_CHECKING:
    from roboirg.envs.environment import RoboIRGEnv


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


LoadPolicy = Callable[[str, int], Policy]


def _load_here(spec: str, seed: int) -> Policy:
    made = make_policy(spec, seed)
    return ChunkedPolicy(made) if isinstance(made, PrivilegedPolicy) else made


class PolicyDispatcher:
    """Holds a policy and carries out requests.

    Args:
        load: makes a policy from its spec and seed.
    """

    def __init__(self, load: LoadPolicy) -> None:
        self._load = load
        self._policy: Any = None  # the loop makes one before anything else
        self._scene_lock: contextlib.AbstractContextManager[object] = contextlib.nullcontext()

    def handle(self, method: str, *args: Any) -> PolicyReply:  # noqa: ANN401
        """Carry out ``make``, ``attach``, ``reset``, ``act`` or ``close``."""
        try:
            with attribute_errors("policy"):
                value = getattr(self, f"_{method}")(*args)
        except EpisodeError as error:
            return PolicyReply(error=(error.kind, str(error), error.details))
        except EpisodeLostError as error:
            return PolicyReply(error=(error.kind, str(error), ""))
        except EndOfRunError as error:
            return PolicyReply(error=("policy", one_line(error), ""))
        return PolicyReply(value, float(getattr(self._policy, "latency_s", 0.0)))

    def _make(self, spec: str, seed: int) -> None:
        self._policy = self._load(spec, seed)

    def _attach(self, env: RoboIRGEnv, lock: contextlib.AbstractContextManager[object]) -> None:
        self._scene_lock = lock
        if isinstance(self._policy, PrivilegedPolicy):
            self._policy.attach(env)

    def _reset(
        self, instruction: str, demonstration: dict[str, Any]
    ) -> tuple[dict[str, Any], dict[str, Any], InferenceFacts]:
        """Return what the policy then says of itself for records: metadata, needs, inference."""
        policy = self._policy
        policy.reset(instruction, demonstration)
        needs = PolicyNeeds.of(policy).declared
        return policy_metadata(policy), needs, inference_facts(policy)

    def _act(self, observation: Any) -> Any:  # noqa: ANN401
        with self._scene_lock:  # the scene must not change while a policy plans in it
            return self._policy.act(observation)

    def _close(self) -> dict[str, float]:
        policy, self._policy = self._policy, None
        usage: Mapping[str, float] = getattr(policy, "usage", dict)()
        getattr(policy, "close", lambda: None)()
        return {str(name): float(cost) for name, cost in usage.items()}


class PolicyThread:
    """A policy in a thread of this process, where a privileged one can read the twin's state.

    The world stands still while it plans: it holds the twin's lock. A thread cannot be killed: a
    closed one ends after its last request, or with the process.

    Args:
        load: makes a policy from its spec and seed.

    Attributes:
        shares_scene: whether the policy runs in this process, so that it can read the twin's state.
    """

    shares_scene = True

    def __init__(self, load: LoadPolicy = _load_here) -> None:
        self._handle = PolicyDispatcher(load).handle
        self._requests: queue.SimpleQueue[tuple[Any, ...] | None] = queue.SimpleQueue()
        self._replies: queue.SimpleQueue[PolicyReply] = queue.SimpleQueue()
        threading.Thread(target=self._run, name="policy", daemon=True).start()

    def send(self, method: str, *args: Any) -> None:  # noqa: ANN401
        self._requests.put((method, *args))

    def receive(self, timeout_s: float) -> PolicyReply | None:
        """Return the next reply; None if there is none within that time."""
        try:
            return self._replies.get(timeout=max(timeout_s, 0.0))
        except queue.Empty:
            return None

    def loss(self) -> EpisodeLostError | None:
        """Return how the policy's process died; None while it is alive."""
        return None

    def close(self) -> None:
        """Let the thread end."""
        self._requests.put(None)

    def _run(self) -> None:
        while (request := self._requests.get()) is not None:
            self._replies.put(self._handle(*request))


class PolicyProcess(PolicyThread):
    """A policy in a process of its own, with the same host as in simulation.

    A thread calls it, because a call blocks while the process does not answer.
    """

    shares_scene = False

    def __init__(self) -> None:
        self._hosts = HostPool(HostSettings(batch=1))
        super().__init__(functools.partial(HostedPolicy, self._hosts.connect()))

    def loss(self) -> EpisodeLostError | None:
        return self._hosts.loss()

    def close(self) -> None:
        """End the process, by force if it does not exit."""
        super().close()
        self._hosts.close()


class ChunkedPolicy:
    """A privileged policy that returns its trajectories a chunk at a time.

    It reads the simulator's state instead of observations, so the rest of a trajectory stays valid.
    All other policies get a new observation after every chunk.
    """

    def __init__(self, policy: Policy) -> None:
        self._policy = policy
        PolicyNeeds.of(policy).declare_on(self)
        self._left: NDArray[np.floating[Any]] = np.zeros((0, 8))

    def attach(self, env: RoboIRGEnv) -> None:
        """Pass the environment on."""
        if isinstance(self._policy, PrivilegedPolicy):
            self._policy.attach(env)

    def reset(self, instruction: str, demonstration: Demonstration) -> None:
        """Start an episode."""
        self._left = self._left[:0]
        self._policy.reset(instruction, demonstration)

    def act(self, observation: Observation) -> NDArray[np.floating[Any]]:
        """Return at most `HORIZON` actions."""
        if not len(self._left):
            self._left = np.atleast_2d(self._policy.act(observation))
        chunk, self._left = self._left[:HORIZON], self._left[HORIZON:]
        return chunk
