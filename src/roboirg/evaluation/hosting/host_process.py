"""The policy's process: carries out the calls of many episodes, one after the other.

It holds nothing of a world but what the contract gives to a policy: instruction, video,
observations. It is started with a clean interpreter. Each episode has a line of its own to its
world; the line to the supervisor brings them.

The call that waits longest is carried out, and with it those of other episodes that can be carried
out together.
"""

from __future__ import annotations

import contextlib
import functools
import io
import os
import selectors
import socket
import struct
import sys
import threading
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from multiprocessing.connection import wait
from pathlib import Path
from typing import Any

from numpy.typing import NDArray

from roboirg.core.actions import JOINT_ANGLE, ActionSpace
from roboirg.core.error_words import one_line
from roboirg.core.errors import MissingDependencyError
from roboirg.core.inference_facts import inference_facts
from roboirg.core.observations import FetchedDemonstration
from roboirg.core.policy_needs import PolicyNeeds
from roboirg.core.policy_ref import PolicyRef
from roboirg.evaluation.episode_errors import describe_error
from roboirg.evaluation.hosting.messages import (
    DRAW_S,
    MAX_TEXT,
    Begun,
    Call,
    Outcome,
    Question,
    receive_call,
    receive_request,
    send,
    take_output,
)
from roboirg.policies.by_name.finding import look_up, make_policy
from roboirg.policies.contract.base import close_policy, tell_policy
from roboirg.policies.contract.policy_calls import (
    check_rows,
    dump_metadata,
    policy_subgoal,
    policy_usage,
)
from roboirg.policies.contract.policy_version import read_version
from roboirg.policies.contract.random_state import RandomState
from roboirg.policies.opening import opened

GATHER_S = 0.003
"""How long a call waits for others that could be carried out together with it."""
STUCK_S = 60
"""How long a world may take to send the rest of a message; then it is given up."""


@dataclass(eq=False)
class HostedEpisode:
    """An episode that this process plays.

    Attributes:
        line: to its world.
        policy: of the episode; None before it is open.
        random: its random numbers.
        space: of its actions.
        alone: whether it must not be asked about together with others.
    """

    line: socket.socket
    policy: Any = None
    random: RandomState = field(default_factory=lambda: RandomState(0))
    space: ActionSpace = JOINT_ANGLE
    alone: bool = False

    def joins(self, call: Call) -> bool:
        """Return whether a call can be carried out together with those of others."""
        can_join = callable(getattr(self.policy, "act_together", None)) and not self.alone
        return can_join and call.method == "act"


class HostProcess:
    """Carries out calls until the supervisor hangs up.

    Args:
        supervisor: the line to it.
    """

    def __init__(self, supervisor: socket.socket) -> None:
        self._supervisor, self._batch = supervisor, 1
        self._ready = selectors.DefaultSelector()
        self._ready.register(supervisor, selectors.EVENT_READ)
        self._episodes: set[HostedEpisode] = set()
        self._waiting: dict[HostedEpisode, Call] = {}
        self._under_way: Sequence[HostedEpisode] = ()
        self._read_fields: dict[str, None] = {}
        self._home, self._thread = os.getcwd(), threading.get_ident()  # noqa: PTH109
        self._output = os.dup(1)  # the policy may close it

    def serve(self) -> None:
        """Carry out every call."""
        with contextlib.suppress(EOFError, OSError):
            self._supervisor.send(b"!")  # it has started
            while True:
                self._collect(0 if self._waiting else None)
                if self._waiting:
                    self._carry_out(self._gather())

    def _collect(self, seconds: float | None) -> None:
        """Take in calls and new episodes; wait at most some seconds for the first one."""
        for key, _ in self._ready.select(seconds):
            episode: HostedEpisode | None = key.data
            if episode is None:
                self._obey()
            elif episode not in self._waiting:
                try:
                    self._waiting[episode] = receive_call(episode.line)
                except (EOFError, OSError):  # its world is gone
                    self._waiting[episode] = Call("close")

    def _obey(self) -> None:
        """Do what the supervisor wants: serve an episode, or answer that this process can."""
        request, line = receive_request(self._supervisor)
        if line is None:
            self._supervisor.send(b"!")
            return
        episode = HostedEpisode(line)
        for limit in (socket.SO_RCVTIMEO, socket.SO_SNDTIMEO):
            episode.line.setsockopt(socket.SOL_SOCKET, limit, struct.pack("ll", STUCK_S, 0))
        self._batch = request.batch
        self._episodes.add(episode)
        self._ready.register(episode.line, selectors.EVENT_READ, episode)

    def _gather(self) -> dict[HostedEpisode, Call]:
        """Return the calls that are carried out now: the oldest one, and what joins it."""
        first, call = next(iter(self._waiting.items()))
        found = {first: call}
        if first.joins(call):
            # Worlds that wait already, and those that are just about to.
            wanted = min(self._batch, sum(not one.alone for one in self._episodes))
            until = time.monotonic() + GATHER_S
            while len(self._waiting) < wanted and (left := until - time.monotonic()) > 0:
                self._collect(left)
            joining = [pair for pair in self._waiting.items() if pair[0].joins(pair[1])]
            found = dict(joining[: self._batch])
        for one in found:
            del self._waiting[one]
        return found

    def _carry_out(self, calls: Mapping[HostedEpisode, Call]) -> None:
        """Carry out calls, and send their outcomes to their worlds."""
        with contextlib.suppress(OSError):
            os.chdir(self._home)  # an earlier episode may have changed it
        together = len(calls) > 1
        for episode in calls:
            _reply(episode, Begun(together))
        self._under_way = tuple(calls)
        if together:
            outcomes = self._act_together(calls)
        else:
            outcomes = [self._outcome(*one) for one in calls.items()]
        self._under_way = ()
        output = self._printed()
        for (episode, call), outcome in zip(calls.items(), outcomes, strict=True):
            outcome.output = output  # what a call for several episodes prints is of all of them
            _reply(episode, outcome)
            if call.method == "close":
                self._forget(episode)

    def _printed(self) -> bytes:
        """Return what the call under way has printed."""
        for stream in (sys.stdout, sys.stderr):
            with contextlib.suppress(Exception):  # a policy may have closed or replaced it
                stream.flush()
        with contextlib.suppress(OSError):
            return take_output(self._output)
        return b""

    def _forget(self, episode: HostedEpisode) -> None:
        self._episodes.discard(episode)
        with contextlib.suppress(KeyError, ValueError):
            self._ready.unregister(episode.line)
        episode.line.close()

    def _outcome(self, episode: HostedEpisode, call: Call) -> Outcome:
        try:
            if call.method == "describe":
                found = opened(_policy(call))
                return Outcome(
                    message=found.problem or "",
                    needs=found.needs or PolicyNeeds(),
                    version=found.version,
                )
            if call.method == "open":
                return self._open(episode, call)
            return self._call(episode, call)
        except BaseException as error:  # noqa: BLE001 - policies may raise anything
            return _failure(error)

    def _open(self, episode: HostedEpisode, call: Call) -> Outcome:
        """Begin an episode with a policy of its own; returns what the world must know of it."""
        episode.random, episode.alone = RandomState(call.seed), call.alone
        with episode.random:
            policy: Any = make_policy(_policy(call), call.seed)
        # Pixels of subgoals are for privileged policies, and those have no process of their own.
        needs = replace(PolicyNeeds.of(policy), grounded=False)
        episode.policy, episode.space = policy, needs.action_space
        version, reads = _fallback(_policy(call)), tuple(self._read_fields)
        return Outcome(needs=needs, version=version, reads=reads)

    def _call(self, episode: HostedEpisode, call: Call) -> Outcome:
        """Call a method of a policy; `reset` and `hear` return its metadata."""
        policy = episode.policy
        with episode.random:
            match call.method:
                case "reset":
                    fetch = functools.partial(self._fetch, episode)
                    fields, arrays = call.value["fields"], call.value["arrays"]
                    video = FetchedDemonstration(fields, arrays, fetch)
                    policy.reset(call.value["instruction"], video)
                    return Outcome(
                        metadata=dump_metadata(policy),
                        inference=inference_facts(policy),
                        version=read_version(policy) or "",
                    )
                case "hear":
                    tell_policy(policy, call.value)
                case "act":
                    return _acted(episode, policy.act(_observation(call)))
                case "usage":
                    return Outcome(usage=policy_usage(policy))
                case "close":
                    close_policy(policy)
                    return Outcome()
            return Outcome(metadata=dump_metadata(policy))

    def _act_together(self, calls: Mapping[HostedEpisode, Call]) -> list[Outcome]:
        """Ask about several episodes at once; a failure is not attributed to any of them."""
        try:
            policies = [episode.policy for episode in calls]
            RandomState.set_aside()
            chunks = policies[0].act_together(policies, list(map(_observation, calls.values())))
            return [_acted(*one) for one in zip(calls, chunks, strict=True)]
        except BaseException as error:  # noqa: BLE001 - policies may raise anything
            return [_failure(error)] * len(calls)

    def _fetch(self, episode: HostedEpisode, fields: Sequence[str]) -> Mapping[str, NDArray[Any]]:
        """Return fields of the video of an episode whose call is under way.

        Raises:
            RuntimeError: no call of this episode is under way in this thread, or the world is gone.
        """
        if episode not in self._under_way or threading.get_ident() != self._thread:
            raise RuntimeError(
                "pictures of the demonstration can be read only while a call of the policy is "
                "under way, by the thread that was called"
            )
        self._read_fields.update(dict.fromkeys(fields))
        answer = Call("gone")
        with contextlib.suppress(EOFError, OSError):
            send(episode.line, Question(tuple(fields)))
            until = time.monotonic() + DRAW_S
            while episode.line not in (
                ready := wait([episode.line, self._supervisor], until - time.monotonic())
            ):
                if not ready:
                    raise TimeoutError
                self._obey()  # a process whose world draws does not hang
            answer = receive_call(episode.line)
        if answer.method == "gone":
            raise RuntimeError("the episode has ended")
        found: Mapping[str, NDArray[Any]] = answer.value
        return found


def _reply(episode: HostedEpisode, message: Begun | Outcome) -> None:
    with contextlib.suppress(OSError):  # its world may be gone
        send(episode.line, message)


def _policy(call: Call) -> PolicyRef:
    if call.policy is None:
        raise ValueError(f"{call.method} names no policy")
    return call.policy


@functools.cache
def _fallback(ref: PolicyRef) -> str:
    """Return the version of a policy that declares none."""
    return look_up(ref).version


def _observation(call: Call) -> Any:  # noqa: ANN401 - an `Observation`
    """Return the observation of a call; sequences travel as lists."""
    if "history" in call.value:
        call.value["history"] = tuple(call.value["history"])
    return call.value


def _acted(episode: HostedEpisode, rows: Any) -> Outcome:  # noqa: ANN401
    """Return what a policy's `act` returned, checked, for a message."""
    chunk, subgoal = check_rows(rows, episode.space), policy_subgoal(episode.policy)
    return Outcome(rows=chunk.tobytes(), size=chunk.shape[1], subgoal=subgoal)


def _failure(error: BaseException) -> Outcome:
    """Return kind, message and traceback of an exception that is being handled."""
    if isinstance(error, MissingDependencyError):
        return Outcome("missing", one_line(error))
    try:
        found = describe_error("policy", error)
    except BaseException:  # noqa: BLE001 - its attributes are a policy's code, too
        return Outcome("policy", "it raised an exception that cannot be described")
    kind: Any = found.kind  # of the policy, never of the environment
    return Outcome(kind, str(found)[:MAX_TEXT], found.details)


def main(supervisor: socket.socket) -> None:
    """Serve worlds; runs in a process of its own."""
    if isinstance(sys.stdout, io.TextIOWrapper):
        sys.stdout.reconfigure(line_buffering=True, errors="replace")
    if sys.path[-1] == str(Path.cwd()):  # where a command puts it: its policy's files come first
        sys.path.insert(0, sys.path.pop())
    HostProcess(supervisor).serve()
    with contextlib.suppress(Exception):
        sys.stdout.flush()
    os._exit(0)  # threads that a policy left behind must not keep this process
