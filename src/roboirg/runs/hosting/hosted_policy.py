"""The world's side of a hosted policy: a policy whose methods are calls of its process.

What comes back is checked like anything from outside: it is plain data, and errors in it are the
policy's.
"""

from __future__ import annotations

import contextlib
import os
import socket
import sys
from collections.abc import Iterable, Sequence
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray
from pydantic import JsonValue

from roboirg.core.errors import EndOfRunError, InvalidValueError, MissingDependencyError
from roboirg.core.inference_facts import InferenceFacts
from roboirg.core.observations import Demonstration, Observation
from roboirg.core.policy_ref import PolicyRef
from roboirg.policies.contract.base import SubgoalEnd
from roboirg.policies.contract.policy_calls import read_metadata
from roboirg.runs.episode_errors import EpisodeError, EpisodeLostError, describe_error
from roboirg.runs.hosting.messages import Call, Outcome, Question
from roboirg.runs.hosting.policy_line import PolicyLine

_DRAWN_SUFFIXES = ("_rgb", "_depth")
"""How the fields of a demonstration end that are drawn when they are read."""
_STDERR = 2
_FLOAT_BYTES = 8
"""Of a number in actions."""


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
            outcome = self._call(Call("open", policy=ref, seed=seed, alone=alone))
            outcome.needs.declare_on(self)  # so that this object declares the policy's needs
        except BaseException:
            self._line.close()
            raise
        self.version = outcome.version
        self._known_reads = outcome.reads  # fields of videos that the policy is known to read

    def reset(self, instruction: str, demonstration: Demonstration) -> None:
        """Begin the episode in the policy's process, and take its metadata and version.

        Of the demonstration, poses travel with the call, and only such pictures as this policy has
        read in earlier episodes; it can ask for all others.
        """
        self._demonstration = demonstration
        fields = list(demonstration)
        # Pictures are slow to draw: those that the policy has not read so far wait until it does.
        undrawn = {field for field in _drawn_fields(fields) if field not in self._known_reads}
        arrays = self._arrays([field for field in fields if field not in undrawn])
        value = {"instruction": instruction, "fields": fields, "arrays": arrays}
        outcome = self._call(Call("reset", value=value))
        self._take_metadata(outcome)
        self.inference = outcome.inference
        self.version = outcome.version or self.version

    def act(self, observation: Observation) -> NDArray[np.float64]:
        """Return the policy's next actions, (n, 8) or (n, 7) float64, and keep its subgoal."""
        # The rows come as bytes of float64, one after the other.
        outcome = self._call(Call("act", value=observation))
        self.subgoal = outcome.subgoal
        row_bytes = _FLOAT_BYTES * outcome.size
        if not outcome.rows or len(outcome.rows) % row_bytes:
            raise EpisodeError("policy", "the policy's process sent actions in part", "")
        return np.frombuffer(outcome.rows, np.float64).reshape(-1, outcome.size).copy()

    def hear(self, text: str, step: int) -> None:
        """Pass on what was said."""
        self._take_metadata(self._call(Call("hear", value={"text": text, "step": step})))

    def usage(self) -> dict[str, float]:
        """Return the cost of the episode; empty after an error."""
        if not self._line.is_open:
            return {}
        return dict(self._call(Call("usage")).usage)

    def close(self) -> None:
        """End the episode; repeated calls do nothing."""
        try:
            if self._line.is_open:
                with contextlib.suppress(EpisodeLostError):  # what is lost needs no end
                    self._call(Call("close"))
        finally:
            self._line.close()

    def _call(self, call: Call) -> Outcome:
        """Carry out a call in the policy's process and return its outcome, without an error.

        Meanwhile the process may ask for pictures of the demonstration, which are drawn here. What
        the policy prints is printed here, so that it gets into the log of the episode.

        Raises:
            EpisodeError: the policy raised, or broke its process; or the world cannot draw.
            EpisodeLostError: the process was lost through no fault of this episode.
            MissingDependencyError: a package that one of our own policies needs is missing.
        """
        self._failure = None
        try:
            outcome = self._line.call(call, self._answer)
        finally:
            _print(self._line.output)
        if self._failure is not None:
            raise self._failure
        if outcome.error is None:
            return outcome
        if outcome.error != "missing":
            raise EpisodeError(outcome.error, outcome.message, outcome.details)
        # A policy of the user's may not end the run by asking to install something.
        if self._ref.is_foreign:
            raise EpisodeError("policy", outcome.message, outcome.details)
        raise MissingDependencyError(outcome.message)

    def _answer(self, question: Question) -> Call:
        """Return the answer to a policy's process that asks for pictures of the demonstration.

        If they cannot be drawn, the answer is that the demonstration is gone. The error is kept in
        `_failure`, which `_call` raises once the policy has returned.
        """
        fields = [field for field in self._demonstration if field in question.fields]
        try:
            return Call("answer", value=self._arrays(fields))
        except EndOfRunError as error:
            self._failure = error
        except Exception as error:  # noqa: BLE001 - the world's, whatever it is
            self._failure = describe_error("environment", error)
        return Call("gone")

    def _take_metadata(self, outcome: Outcome) -> None:
        """Keep the metadata that the policy reports; wrong ones are its error."""
        try:
            self.metadata = read_metadata(outcome.metadata)
        except (InvalidValueError, ValueError) as error:
            raise EpisodeError("policy", str(error), "") from error

    def _arrays(self, fields: Sequence[str]) -> dict[str, NDArray[Any]]:
        """Return arrays of the demonstration by field, each (frames, …); pictures are drawn now."""
        draw = getattr(self._demonstration, "draw", None)
        all_drawn = _drawn_fields(self._demonstration)
        # Reading one field replays the episode for its camera; to draw all takes one replay.
        if draw is not None and len(all_drawn) > 1 and len(_drawn_fields(fields)) == len(all_drawn):
            draw()
        return {field: self._demonstration[field] for field in fields}


class HostedPlanner(HostedPolicy):
    """A planner in a process of its own, whose hands are in this one."""

    _new_ends: tuple[SubgoalEnd, ...] = ()

    def learn(self, end: SubgoalEnd) -> None:
        """Keep how a subgoal ended for the next call."""
        self._new_ends += (end,)

    def plan(self, observation: Observation, step: int) -> str | None:
        """Return the subgoal that the planner names for now; None for none.

        The planner also gets the control step, and how subgoals ended since the last call.
        """
        seen: dict[str, Any] = {**observation, "step": step, "ends": self._new_ends}
        self._new_ends = ()
        self.act(cast("Observation", seen))
        return self.subgoal


def _drawn_fields(fields: Iterable[str]) -> list[str]:
    """Return the fields of a demonstration that are drawn when they are read."""
    return [field for field in fields if field.endswith(_DRAWN_SUFFIXES)]


def _print(output: bytes) -> None:
    """Print what the policy printed, so that it is in the log of its episode."""
    if not output:
        return
    with contextlib.suppress(OSError):
        sys.stderr.flush()
        file = sys.__stderr__.fileno() if sys.__stderr__ else _STDERR
        os.write(file, output)
