"""The world's side of a hosted policy: a policy whose methods are calls to its host.

What comes back is checked like anything from outside: it is plain data, and errors in it are the
policy's.
"""

from __future__ import annotations

import contextlib
import mmap
import os
import socket
import sys
import time
from collections.abc import Sequence
from multiprocessing.connection import Connection
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray
from pydantic import JsonValue

from roboirg.core.errors import InvalidValueError, MissingDependencyError
from roboirg.core.inference_facts import InferenceFacts
from roboirg.core.observations import Demonstration, Observation
from roboirg.evaluation.episode_errors import EpisodeError, EpisodeLostError, attribute_errors
from roboirg.evaluation.hosting.messages import (
    Acted,
    Ask,
    Call,
    Failure,
    Lost,
    Opened,
    Payload,
    Told,
    encode,
    map_block,
    new_block,
    pack_payload,
    read_supervisor,
)
from roboirg.evaluation.policy_calls import read_metadata
from roboirg.policies.contract.policy_urls import is_url

_DRAWN = ("_rgb", "_depth")
"""How the fields of a demonstration end that are drawn when they are read."""
_SENT = "the policy's process sent"

Found = TypeVar("Found", Opened, Told, Acted)


class HostedPolicy:
    """A policy in its host's process, for one episode.

    Args:
        hosts: the line on which to ask for its host, of `HostPool.connect`.
        spec: of the policy.
        seed: of its random choices.
        alone: whether it must not be asked about this episode together with others.

    Attributes:
        version: of the policy.
        metadata: as the policy reports them, from `reset` on.
        inference: what its process computes with, from `reset` on.
        waited_s: seconds that its calls waited for others.
        latency_s: seconds that its last actions took on its own robot, if it reports that.
        subgoal: what it named after its last actions, if anything.

    Raises:
        EpisodeError: the policy cannot be made.
        EpisodeLostError: its process was lost.
        MissingDependencyError: a package that one of our own policies needs is not installed.
    """

    def __init__(self, hosts: socket.socket, spec: str, seed: int, *, alone: bool = False) -> None:
        self._spec = spec
        self.metadata: dict[str, JsonValue] = {}
        self.inference: InferenceFacts | None = None
        self.waited_s = self.latency_s = 0.0
        self.subgoal: str | None = None
        self._demonstration: Demonstration = {}
        self._sent: Payload = pack_payload(None)
        self._is_open = True
        with contextlib.ExitStack() as undo:
            self._connection, self._block = _begin_episode(hosts)
            undo.callback(self._block.close)
            undo.callback(self._connection.close)
            found = self._call(Opened, Call("open", spec=spec, seed=seed, alone=alone))
            found.needs.declare_on(self)
            self.version, self._reads = found.version, found.reads
            self._end = undo.pop_all()

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
        found = self._call(Told, self._pack("reset", value))
        self._take_metadata(found)
        self.inference = found.inference

    def act(self, observation: Observation) -> NDArray[np.float64]:
        """Return the next actions (n, 8) or (n, 7)."""
        found = self._call(Acted, self._pack("act", observation))
        self.latency_s, self.subgoal = found.latency_s, found.subgoal
        if not found.rows or len(found.rows) % (8 * found.size):
            raise EpisodeError("policy", f"{_SENT} actions in part", "")
        return np.frombuffer(found.rows, np.float64).reshape(-1, found.size).copy()

    def hear(self, text: str, step: int) -> None:
        """Let the policy hear what was said."""
        utterance = {"text": text, "step": step}
        self._take_metadata(self._call(Told, Call("hear", utterances=(utterance,))))

    def usage(self) -> dict[str, float]:
        """Return the cost of the episode; empty after an error."""
        return dict(self._call(Told, Call("usage")).usage) if self._is_open else {}

    def close(self) -> None:
        """End the episode; repeated calls do nothing."""
        is_open, self._is_open = self._is_open, False
        with self._end, contextlib.suppress(EpisodeLostError):  # what is lost needs no end
            if is_open:
                self._call(Told, Call("close"))

    def _call(self, kind: type[Found], call: Call) -> Found:
        """Call the host, draw what it asks for, and return the outcome.

        Raises:
            EpisodeError: the policy raised, or broke its process.
            EpisodeLostError: the process was lost through no fault of this episode.
            MissingDependencyError: a package that one of our own policies needs is missing.
        """
        start = time.perf_counter()
        try:
            self._connection.send_bytes(encode(call))
            while isinstance(reply := read_supervisor(self._connection.recv_bytes()), Ask):
                self._connection.send_bytes(encode(self._draw(reply)))
        except (EOFError, OSError) as error:
            self._is_open = False
            raise _lost() from error
        except EpisodeError:
            self._is_open = False  # the host waits for an answer
            raise
        _print(reply.output)
        self.waited_s += max(time.perf_counter() - start - reply.seconds, 0.0)
        outcome = reply.outcome
        if isinstance(outcome, Failure | Lost):
            raise self._error(outcome)
        if not isinstance(outcome, kind):
            raise EpisodeError("policy", f"{_SENT} something else than was asked for", "")
        return outcome

    def _error(self, outcome: Failure | Lost) -> Exception:
        """Return what a failure raises here."""
        if isinstance(outcome, Failure):
            if outcome.kind != "missing":
                return EpisodeError(outcome.kind, outcome.message, outcome.details)
            if is_url(self._spec):
                return MissingDependencyError(outcome.message)
            return EpisodeError("policy", outcome.message, "")
        self._is_open = False
        if outcome.again:
            return EpisodeLostError(outcome.kind, outcome.message, alone=outcome.alone)
        return EpisodeError(outcome.kind, outcome.message, "")

    def _take_metadata(self, found: Told) -> None:
        try:
            self.metadata = read_metadata(found.metadata, is_ours=False)
        except (InvalidValueError, ValueError) as error:
            raise EpisodeError("policy", str(error), "") from error

    def _draw(self, question: Ask) -> Call:
        """Return the answer to a question of the policy's process."""
        if question.start is not None:
            self._sent.copy_to(self._block, question.start)
            return Call("answer")
        wanted = [field for field in self._demonstration if field in question.fields]
        with attribute_errors("environment"):
            return self._pack("answer", self._drawn(wanted))

    def _drawn(self, fields: Sequence[str]) -> dict[str, NDArray[Any]]:
        draw = getattr(self._demonstration, "draw", None)
        drawn = [field for field in fields if field.endswith(_DRAWN)]
        everything = sum(field.endswith(_DRAWN) for field in self._demonstration)
        if draw is not None and len(drawn) == everything > 1:
            draw()  # all cameras in one replay
        return {field: self._demonstration[field] for field in fields}

    def _pack(self, method: str, value: object) -> Call:
        """Put the arrays of a value into shared memory; return the rest as a call."""
        self._sent = pack_payload(value)
        self._sent.copy_to(self._block, 0)
        return Call(method, tree=self._sent.tree, size=self._sent.size)


def _begin_episode(hosts: socket.socket) -> tuple[Connection, mmap.mmap]:
    """Return a connection to the supervisor, and memory shared with the policy's process."""
    ours, theirs = socket.socketpair()
    block = new_block()
    with theirs:
        try:
            socket.send_fds(hosts, [b"\0"], [theirs.fileno(), block])
        except OSError as error:
            ours.close()
            os.close(block)
            raise _lost() from error
    return Connection(ours.detach()), map_block(block)


def _print(output: bytes) -> None:
    """Print what the policy printed, so that it is in the log of its episode."""
    if output:
        with contextlib.suppress(OSError):
            sys.stderr.flush()
            os.write(sys.__stderr__.fileno() if sys.__stderr__ else 2, output)


def _lost() -> EpisodeLostError:
    return EpisodeLostError("infrastructure", "the policy's host is gone", alone=False)
