"""The policy's process: carries out the calls of many episodes, one after the other.

It holds nothing of a world but what the contract gives to a policy: instruction, video,
observations. It is started with a clean interpreter, and its only way out is one socket.
"""

from __future__ import annotations

import contextlib
import functools
import io
import os
import socket
import sys
import threading
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from numpy.typing import NDArray

from roboirg.core.actions import ActionSpace
from roboirg.core.errors import MissingDependencyError
from roboirg.core.inference_facts import inference_facts
from roboirg.core.observations import FetchedDemonstration
from roboirg.core.policy_needs import PolicyNeeds
from roboirg.core.policy_ref import PolicyRef
from roboirg.evaluation.episode_errors import describe_error, one_line
from roboirg.evaluation.hosting.messages import (
    MAX_TEXT,
    Call,
    Outcome,
    Question,
    receive_calls,
    send,
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


class HostProcess:
    """Carries out calls until the line closes.

    Args:
        line: to the supervisor.
    """

    def __init__(self, line: socket.socket) -> None:
        self._line = line
        self._episodes: dict[int, tuple[Any, RandomState, ActionSpace]] = {}
        self._read_fields: dict[str, None] = {}
        self._asking: set[int] = set()
        self._home, self._thread = os.getcwd(), threading.get_ident()  # noqa: PTH109

    def serve(self) -> None:
        """Answer every message."""
        with contextlib.suppress(EOFError, OSError):
            while True:
                calls = receive_calls(self._line)
                send(self._line, self._answer(calls))

    def _answer(self, calls: Sequence[Call]) -> list[Outcome]:
        with contextlib.suppress(OSError):
            os.chdir(self._home)  # an earlier episode may have changed it
        self._asking = {call.session for call in calls}
        together = len(calls) > 1
        outcomes = self._act_together(calls) if together else list(map(self._outcome, calls))
        self._asking = set()
        for stream in (sys.stdout, sys.stderr):
            with contextlib.suppress(Exception):  # a policy may have closed or replaced it
                stream.flush()
        return outcomes

    def _outcome(self, call: Call) -> Outcome:
        try:
            if call.method == "describe":
                found = opened(_policy(call))
                return Outcome(
                    message=found.problem or "",
                    needs=found.needs or PolicyNeeds(),
                    version=found.version,
                )
            if call.method == "open":
                return self._open(call)
            return self._carry_out(call, *self._episodes[call.session])
        except BaseException as error:  # noqa: BLE001 - policies may raise anything
            return _failure(error)

    def _open(self, call: Call) -> Outcome:
        """Begin an episode with a policy of its own; returns what the world must know of it."""
        random = RandomState(call.seed)
        with random:
            policy: Any = make_policy(_policy(call), call.seed)
        # Pixels of subgoals are for privileged policies, and those have no host.
        needs = replace(PolicyNeeds.of(policy), grounded=False)
        self._episodes[call.session] = policy, random, needs.action_space
        return Outcome(
            needs=needs,
            version=_fallback(_policy(call)),
            together=callable(getattr(policy, "act_together", None)),
            reads=tuple(self._read_fields),
        )

    def _carry_out(
        self,
        call: Call,
        policy: Any,  # noqa: ANN401 - of any class
        random: RandomState,
        space: ActionSpace,
    ) -> Outcome:
        """Call a method of a policy; `reset` and `hear` return its metadata."""
        with random:
            match call.method:
                case "reset":
                    fetch = functools.partial(self._fetch, call.session)
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
                    return _acted(policy, space, policy.act(_observation(call)))
                case "usage":
                    return Outcome(usage=policy_usage(policy))
                case "close":
                    del self._episodes[call.session]
                    close_policy(policy)
                    return Outcome()
            return Outcome(metadata=dump_metadata(policy))

    def _act_together(self, calls: Sequence[Call]) -> list[Outcome]:
        """Ask about several episodes at once; a failure is not attributed to any of them."""
        try:
            policies, _, spaces = zip(*(self._episodes[one.session] for one in calls), strict=True)
            RandomState.set_aside()
            chunks = policies[0].act_together(list(policies), list(map(_observation, calls)))
            return [_acted(*one) for one in zip(policies, spaces, chunks, strict=True)]
        except BaseException as error:  # noqa: BLE001 - policies may raise anything
            return [_failure(error)] * len(calls)

    def _fetch(self, session: int, fields: Sequence[str]) -> Mapping[str, NDArray[Any]]:
        """Return fields of the video of an episode whose call is under way.

        Raises:
            RuntimeError: no call of this episode is under way in this thread, or the world is gone.
        """
        if session not in self._asking or threading.get_ident() != self._thread:
            raise RuntimeError(
                "pictures of the demonstration can be read only while a call of the policy is "
                "under way, by the thread that was called"
            )
        self._read_fields.update(dict.fromkeys(fields))
        send(self._line, Question(session, tuple(fields)))
        (answer,) = receive_calls(self._line)
        if answer.method == "gone":
            raise RuntimeError("the episode has ended")
        found: Mapping[str, NDArray[Any]] = answer.value
        return found


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


def _acted(policy: Any, space: ActionSpace, rows: Any) -> Outcome:  # noqa: ANN401
    """Return what a policy's `act` returned, checked, for a message."""
    chunk = check_rows(rows, space)
    return Outcome(rows=chunk.tobytes(), size=chunk.shape[1], subgoal=policy_subgoal(policy))


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


def main(line: socket.socket) -> None:
    """Serve a supervisor; runs in a process of its own."""
    if isinstance(sys.stdout, io.TextIOWrapper):
        sys.stdout.reconfigure(line_buffering=True)
    if sys.path[-1] == str(Path.cwd()):  # where a command puts it: its policy's files come first
        sys.path.insert(0, sys.path.pop())
    HostProcess(line).serve()
    with contextlib.suppress(Exception):
        sys.stdout.flush()
    os._exit(0)  # threads that a policy left behind must not keep this process
