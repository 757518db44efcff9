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
from roboirg.policies.by_name.finding import look_up, make_policy
from roboirg.policies.contract.base import close_policy, tell_policy
from roboirg.policies.contract.policy_calls import (
    check_rows,
    dump_metadata,
    policy_subgoal,
    policy_usage,
)
from roboirg.policies.contract.policy_version import read_version
from roboirg.policies.contract.random_state import RandomState, RandomTurns
from roboirg.policies.opening import opened
from roboirg.records.episode_log import flush_streams
from roboirg.runs.episode_errors import describe_error
from roboirg.runs.hosting.messages import (
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

    def can_join(self, call: Call) -> bool:
        """Return whether a call can be carried out in a batch with those of other episodes.

        Only `act` can, of a policy with the method `act_together`.
        """
        if self.alone or call.method != "act":
            return False
        return callable(getattr(self.policy, "act_together", None))


class HostProcess:
    """Carries out calls until the supervisor hangs up.

    Args:
        supervisor: the line to it.
    """

    def __init__(self, supervisor: socket.socket) -> None:
        self._supervisor = supervisor
        self._batch = 1
        self._ready = selectors.DefaultSelector()
        self._ready.register(supervisor, selectors.EVENT_READ)
        self._episodes: set[HostedEpisode] = set()
        self._waiting: dict[HostedEpisode, Call] = {}  # the oldest call first
        self._under_way: Sequence[HostedEpisode] = ()
        self._read_fields: dict[str, None] = {}  # of videos; a set that keeps its order
        self._random_turns = RandomTurns()
        self._home = os.getcwd()  # noqa: PTH109
        self._thread = threading.get_ident()
        self._output = os.dup(1)  # the policy may close it

    def serve(self) -> None:
        """Carry out all calls of worlds until the supervisor closes its line."""
        with contextlib.suppress(EOFError, OSError):
            self._supervisor.send(b"!")  # it has started
            while True:
                self._collect(0 if self._waiting else None)
                if self._waiting:
                    self._carry_out(self._gather())

    def _collect(self, seconds: float | None) -> None:
        """Receive what is on the lines: calls of worlds, and requests of the supervisor.

        A call is added to those that wait. If a line was closed, that counts as a call of `close`.

        Args:
            seconds: how long to wait for the first one; None for ever.
        """
        for key, _ in self._ready.select(seconds):
            episode: HostedEpisode | None = key.data
            if episode is None:
                self._take_request()
            elif episode not in self._waiting:
                try:
                    self._waiting[episode] = receive_call(episode.line)
                except (EOFError, OSError):  # its world is gone
                    self._waiting[episode] = Call("close")

    def _take_request(self) -> None:
        """Carry out a request of the supervisor.

        It asks to serve a new episode, whose line to its world comes with the request, or whether
        this process is alive.
        """
        request, line = receive_request(self._supervisor)
        if line is None:  # a request without a line only asks for that answer
            self._supervisor.send(b"!")
            return
        whole_seconds = struct.pack("ll", STUCK_S, 0)
        line.setsockopt(socket.SOL_SOCKET, socket.SO_RCVTIMEO, whole_seconds)
        line.setsockopt(socket.SOL_SOCKET, socket.SO_SNDTIMEO, whole_seconds)
        episode = HostedEpisode(line)
        self._batch = request.batch
        self._episodes.add(episode)
        self._ready.register(line, selectors.EVENT_READ, episode)

    def _gather(self) -> dict[HostedEpisode, Call]:
        """Return the calls to carry out now, by episode, and remove them from those that wait.

        That is the oldest call. If it can be carried out in a batch, others that can are added, up
        to `_batch` calls in all.
        """
        oldest, call = next(iter(self._waiting.items()))
        gathered = {oldest: call}
        if oldest.can_join(call):
            self._wait_for_others()
            for episode, other_call in self._waiting.items():
                if len(gathered) < self._batch and episode.can_join(other_call):
                    gathered[episode] = other_call
        for episode in gathered:
            del self._waiting[episode]
        return gathered

    def _wait_for_others(self) -> None:
        """Receive calls for a batch until it is full, for `GATHER_S` seconds at most."""
        joinable = [episode for episode in self._episodes if not episode.alone]
        wanted = min(self._batch, len(joinable))
        until = time.monotonic() + GATHER_S
        while len(self._waiting) < wanted:
            seconds_left = until - time.monotonic()
            if seconds_left <= 0:
                return
            self._collect(seconds_left)

    def _carry_out(self, calls: Mapping[HostedEpisode, Call]) -> None:
        """Carry out one call, or several in a batch, and send each world the outcome of its call.

        Before, each world gets a message that its call begins, from when its time limit counts.
        """
        with contextlib.suppress(OSError):
            os.chdir(self._home)  # an earlier episode may have changed it
        are_together = len(calls) > 1
        for episode in calls:
            _reply(episode, Begun(are_together))
        self._under_way = tuple(calls)
        if are_together:
            outcomes = self._act_together(calls)
        else:
            outcomes = [self._outcome(episode, call) for episode, call in calls.items()]
        self._under_way = ()
        output = self._printed()
        for (episode, call), outcome in zip(calls.items(), outcomes, strict=True):
            outcome.output = output  # what a batch prints is in the log of each of its episodes
            _reply(episode, outcome)
            if call.method == "close":
                self._forget(episode)

    def _printed(self) -> bytes:
        """Return what this process has printed since it was last asked, and forget it."""
        flush_streams()
        with contextlib.suppress(OSError):
            return take_output(self._output)
        return b""

    def _forget(self, episode: HostedEpisode) -> None:
        """Close the line of an episode that has ended, and listen to it no longer."""
        self._episodes.discard(episode)
        with contextlib.suppress(KeyError, ValueError):
            self._ready.unregister(episode.line)
        episode.line.close()

    def _outcome(self, episode: HostedEpisode, call: Call) -> Outcome:
        """Return the outcome of one call, which is carried out alone; an exception becomes one."""
        try:
            if call.method == "describe":
                ref = opened(_policy_of(call))
                needs = ref.needs or PolicyNeeds()
                return Outcome(message=ref.problem or "", needs=needs, version=ref.version)
            if call.method == "open":
                return self._open(episode, call)
            return self._call(episode, call)
        except BaseException as error:  # noqa: BLE001 - policies may raise anything
            return _failure_outcome(error)

    def _open(self, episode: HostedEpisode, call: Call) -> Outcome:
        """Make the policy of an episode; return its needs, version, and the video fields it reads.

        Random numbers of its constructor follow from the seed of the call.
        """
        ref = _policy_of(call)
        episode.random = RandomState(call.seed)
        episode.alone = call.alone
        self._random_turns.begin(episode.random)
        policy: Any = make_policy(ref, call.seed)
        # `grounded` asks for pixels of subgoals. Only privileged policies get those, and privileged
        # policies have no process of their own.
        needs = replace(PolicyNeeds.of(policy), grounded=False)
        episode.policy = policy
        episode.space = needs.action_space
        reads = tuple(self._read_fields)
        return Outcome(needs=needs, version=_undeclared_version(ref), reads=reads)

    def _call(self, episode: HostedEpisode, call: Call) -> Outcome:
        """Return the outcome of a method of a policy: actions, costs or metadata.

        The global random generators have the state of the episode meanwhile.
        """
        policy = episode.policy
        self._random_turns.begin(episode.random)
        match call.method:
            case "reset":
                policy.reset(call.value["instruction"], self._demonstration(episode, call))
                return Outcome(
                    metadata=dump_metadata(policy),
                    inference=inference_facts(policy),
                    version=read_version(policy) or "",
                )
            case "hear":
                tell_policy(policy, call.value["text"], call.value["step"])
            case "act":
                return _action_outcome(episode, policy.act(_observation(call)))
            case "usage":
                return Outcome(usage=policy_usage(policy))
            case "close":
                close_policy(policy)
                return Outcome()
        return Outcome(metadata=dump_metadata(policy))

    def _demonstration(self, episode: HostedEpisode, call: Call) -> FetchedDemonstration:
        """Return the video of an episode; what did not come with the call is fetched when read."""
        fetch = functools.partial(self._fetch, episode)
        return FetchedDemonstration(call.value["fields"], call.value["arrays"], fetch)

    def _act_together(self, calls: Mapping[HostedEpisode, Call]) -> list[Outcome]:
        """Return the outcomes of `act` for several episodes, which the policy gets as one batch.

        If that fails, all get the failure. Their worlds then play the episodes again, each alone,
        to see whose failure it is.
        """
        try:
            policies = [episode.policy for episode in calls]
            observations = [_observation(call) for call in calls.values()]
            self._random_turns.end()
            answers = policies[0].act_together(policies, observations)
            return [
                _action_outcome(episode, rows) for episode, rows in zip(calls, answers, strict=True)
            ]
        except BaseException as error:  # noqa: BLE001 - policies may raise anything
            return [_failure_outcome(error)] * len(calls)

    def _fetch(self, episode: HostedEpisode, fields: Sequence[str]) -> Mapping[str, NDArray[Any]]:
        """Return arrays of the demonstration video by field, which the episode's world draws now.

        A policy gets this as a function, so it may call it at any time and from any thread; only
        during a call of its episode can the world answer.

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
            self._wait_for_drawing(episode.line)
            answer = receive_call(episode.line)
        if answer.method == "gone":
            raise RuntimeError("the episode has ended")
        arrays: Mapping[str, NDArray[Any]] = answer.value
        return arrays

    def _wait_for_drawing(self, line: socket.socket) -> None:
        """Wait until a world has drawn pictures for the call under way.

        Meanwhile requests of the supervisor are answered, so that it does not take this process for
        one that hangs.

        Raises:
            TimeoutError: the world takes too long.
        """
        until = time.monotonic() + DRAW_S
        while True:
            ready = wait([line, self._supervisor], until - time.monotonic())
            if line in ready:
                return
            if not ready:
                raise TimeoutError
            self._take_request()


def _reply(episode: HostedEpisode, message: Begun | Outcome) -> None:
    with contextlib.suppress(OSError):  # its world may be gone
        send(episode.line, message)


def _policy_of(call: Call) -> PolicyRef:
    """Return the policy that a call names."""
    if call.policy is None:
        raise ValueError(f"{call.method} names no policy")
    return call.policy


@functools.cache
def _undeclared_version(ref: PolicyRef) -> str:
    """Return the version of a policy that declares none: of its files, for example."""
    return look_up(ref).version


def _observation(call: Call) -> Any:  # noqa: ANN401 - an `Observation`
    """Return the observation of a call; sequences travel as lists."""
    if "history" in call.value:
        call.value["history"] = tuple(call.value["history"])
    return call.value


def _action_outcome(episode: HostedEpisode, rows: Any) -> Outcome:  # noqa: ANN401
    """Return the outcome of `act` with the policy's actions, which are checked.

    Args:
        episode: of the call.
        rows: what the policy returned; must be (n, size) numbers.
    """
    chunk = check_rows(rows, episode.space)
    subgoal = policy_subgoal(episode.policy)
    return Outcome(rows=chunk.tobytes(), size=chunk.shape[1], subgoal=subgoal)


def _failure_outcome(error: BaseException) -> Outcome:
    """Return the outcome of a call that raised an exception, which is being handled.

    It has kind, message and traceback.
    """
    if isinstance(error, MissingDependencyError):
        return Outcome("missing", one_line(error))
    try:
        found = describe_error("policy", error)
    except BaseException:  # noqa: BLE001 - its attributes are a policy's code, too
        return Outcome("policy", "it raised an exception that cannot be described")
    kind: Any = found.kind  # of the policy, never of the environment
    return Outcome(kind, str(found)[:MAX_TEXT], found.details)


def main(supervisor: socket.socket) -> None:
    """Serve worlds until the supervisor hangs up, then end this process."""
    if isinstance(sys.stdout, io.TextIOWrapper):
        sys.stdout.reconfigure(line_buffering=True, errors="replace")
    if sys.path[-1] == str(Path.cwd()):  # where a command puts it: its policy's files come first
        sys.path.insert(0, sys.path.pop())
    HostProcess(supervisor).serve()
    with contextlib.suppress(Exception):
        sys.stdout.flush()
    os._exit(0)  # threads that a policy left behind must not keep this process
