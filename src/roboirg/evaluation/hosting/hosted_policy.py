"""The world's side of a hosted policy: a policy whose methods are calls of its process.

What comes back is checked like anything from outside: it is plain data, and errors in it are the
policy's.
"""

from __future__ import annotations

import contextlib
import os
import socket
import sys
from collections.abc import Sequence
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray
from pydantic import JsonValue

from roboirg.core.errors import EndOfRunError, InvalidValueError, MissingDependencyError
from roboirg.core.inference_facts import InferenceFacts
from roboirg.core.observations import Demonstration, Observation
from roboirg.core.policy_ref import PolicyRef
from roboirg.evaluation.episode_errors import EpisodeError, EpisodeLostError, describe_error
from roboirg.evaluation.hosting.messages import Call, Outcome, Question
from roboirg.evaluation.hosting.policy_line import PolicyLine
from roboirg.policies.contract.base import SubgoalEnd
from roboirg.policies.contract.policy_calls import read_metadata

_DRAWN = ("_rgb", "_depth")
"""How the fields of a demonstration end that are drawn when they are read."""


class HostedPolicy:
    """A policy in a process of its own, for one episode.

    Args:
        hosts: the line on which to ask for its process, of `HostPool.connect`.
        ref: the policy, or the part of it that has a process of its own.
        seed: of its random choices.
        limit_s: how long a call may take; None for no limit.
        alone: whether it must not be asked about this episode together with others.

    Attributes:
        version: that the policy declares when its `reset` has ended, else a fingerprint.
        metadata: as the policy reports them, from `reset` on.
        inference: what its process computes with, from `reset` on.
        subgoal: what it named after its last actions, if anything.

    Raises:
        EpisodeError: the policy cannot be made.
        EpisodeLostError: its process was lost.
        MissingDependencyError: a package that one of our own policies needs is not installed.
    """

    def __init__(
        self,
        hosts: socket.socket,
        ref: PolicyRef,
        seed: int,
        limit_s: float | None = None,
        *,
        alone: bool = False,
    ) -> None:
        self._ref = ref
        self.metadata: dict[str, JsonValue] = {}
        self.inference: InferenceFacts | None = None
        self.subgoal: str | None = None
        self._demonstration: Demonstration = {}
        self._failure: Exception | None = None
        self._line = PolicyLine(hosts, ref, limit_s, alone=alone)
        try:
            found = self._call(Call("open", policy=ref, seed=seed, alone=alone))
            found.needs.declare_on(self)
        except BaseException:
            self._line.close()
            raise
        self.version, self._reads = found.version, found.reads

    def reset(self, instruction: str, demonstration: Demonstration) -> None:
        """Begin the episode."""
        self._demonstration = demonstration
        now = [
            field for field in demonstration if not field.endswith(_DRAWN) or field in self._reads
        ]
        value = {
            "instruction": instruction,
            "fields": list(demonstration),
            "arrays": self._drawn(now),
        }
        found = self._call(Call("reset", value=value))
        self._take_metadata(found)
        self.inference, self.version = found.inference, found.version or self.version

    def act(self, observation: Observation) -> NDArray[np.float64]:
        """Return the next actions (n, 8) or (n, 7)."""
        found = self._call(Call("act", value=observation))
        self.subgoal = found.subgoal
        if not found.rows or len(found.rows) % (8 * found.size):
            raise EpisodeError("policy", "the policy's process sent actions in part", "")
        return np.frombuffer(found.rows, np.float64).reshape(-1, found.size).copy()

    def hear(self, text: str, step: int) -> None:
        """Pass on what was said."""
        self._take_metadata(self._call(Call("hear", value=[{"text": text, "step": step}])))

    def usage(self) -> dict[str, float]:
        """Return the cost of the episode; empty after an error."""
        return dict(self._call(Call("usage")).usage) if self._line.is_open else {}

    def close(self) -> None:
        """End the episode; repeated calls do nothing."""
        try:
            if self._line.is_open:
                with contextlib.suppress(EpisodeLostError):  # what is lost needs no end
                    self._call(Call("close"))
        finally:
            self._line.close()

    def _call(self, call: Call) -> Outcome:
        """Call the policy, draw what it asks for, and return the outcome.

        Raises:
            EpisodeError: the policy raised, or broke its process; or the world cannot draw.
            EpisodeLostError: the process was lost through no fault of this episode.
            MissingDependencyError: a package that one of our own policies needs is missing.
        """
        self._failure = None
        try:
            outcome = self._line.call(call, self._draw)
        finally:
            _print(self._line.output)
        if self._failure is not None:
            raise self._failure
        match outcome:
            case Outcome(error=None):
                return outcome
            case Outcome(error="missing", message=words) if not self._ref.is_foreign:
                # Only our own code can ask the user to install something.
                raise MissingDependencyError(words)
            case Outcome(error, message, details):
                kind: Any = "policy" if error == "missing" else error
                raise EpisodeError(kind, message, details)

    def _draw(self, question: Question) -> Call:
        """Return fields of the video; what goes wrong is raised once the policy has returned."""
        wanted = [field for field in self._demonstration if field in question.fields]
        try:
            return Call("answer", value=self._drawn(wanted))
        except EndOfRunError as error:
            self._failure = error
        except Exception as error:  # noqa: BLE001 - the world's, whatever it is
            self._failure = describe_error("environment", error)
        return Call("gone")

    def _take_metadata(self, found: Outcome) -> None:
        try:
            self.metadata = read_metadata(found.metadata)
        except (InvalidValueError, ValueError) as error:
            raise EpisodeError("policy", str(error), "") from error

    def _drawn(self, fields: Sequence[str]) -> dict[str, NDArray[Any]]:
        draw = getattr(self._demonstration, "draw", None)
        drawn = [field for field in fields if field.endswith(_DRAWN)]
        everything = sum(field.endswith(_DRAWN) for field in self._demonstration)
        if draw is not None and len(drawn) == everything > 1:
            draw()  # all cameras in one replay
        return {field: self._demonstration[field] for field in fields}


class HostedPlanner(HostedPolicy):
    """A planner in a process of its own, whose hands are in this one."""

    _ends: tuple[SubgoalEnd, ...] = ()

    def learn(self, end: SubgoalEnd) -> None:
        """Keep how a subgoal ended for the next call."""
        self._ends += (end,)

    def plan(self, observation: Observation, step: int) -> str | None:
        """Return the subgoal from now on."""
        seen: dict[str, Any] = {**observation, "step": step, "ends": self._ends}
        self._ends = ()
        self.act(cast("Observation", seen))
        return self.subgoal


def _print(output: bytes) -> None:
    """Print what the policy printed, so that it is in the log of its episode."""
    if output:
        with contextlib.suppress(OSError):
            sys.stderr.flush()
            os.write(sys.__stderr__.fileno() if sys.__stderr__ else 2, output)
