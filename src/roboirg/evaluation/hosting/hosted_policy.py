"""The world's side of a hosted policy: a policy whose methods are calls to its host.

What comes back is checked like anything from outside: it is plain data, and errors in it are the
policy's.
"""

from __future__ import annotations

import contextlib
import json
import os
import sys
import time
from collections.abc import Iterator, Mapping, Sequence
from multiprocessing.connection import Client, Connection
from multiprocessing.shared_memory import SharedMemory
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pydantic import JsonValue

from roboirg.core.errors import MissingDependencyError
from roboirg.core.observations import Demonstration, Observation
from roboirg.core.plain_text import clip_text
from roboirg.evaluation.episode_errors import (
    MAX_DETAILS_LENGTH,
    EpisodeError,
    EpisodeLostError,
    attribute_errors,
)
from roboirg.evaluation.hosting.host_pool import HostAddress
from roboirg.evaluation.hosting.host_process import MISSING
from roboirg.evaluation.hosting.payload import (
    BLOCK_SIZE,
    Message,
    Payload,
    buffer_of,
    decode,
    encode,
    pack_payload,
)
from roboirg.evaluation.records.record import ERROR_KINDS
from roboirg.policies.contract.policy_needs import PolicyNeeds
from roboirg.policies.contract.policy_urls import is_url

_DRAWN = ("_rgb", "_depth")
"""How the fields of a demonstration end that are drawn when they are read."""
_MAX_TEXT_LENGTH = 2000


class HostedPolicy:
    """A policy in its host's process, for one episode.

    Args:
        hosts: where to ask for its host.
        spec: of the policy.
        seed: of its random choices.
        alone: whether it must not be asked about this episode together with others.

    Attributes:
        is_privileged: whether it must be run in the world's process instead.
        version: of the policy.
        metadata: as the policy reports them, from `reset` on.
        waited_s: seconds that its calls waited for others.
        latency_s: seconds that its last actions took on the robot it is meant for, if it tells.

    Raises:
        EpisodeError: the policy cannot be made.
        EpisodeLostError: its process was lost.
        MissingDependencyError: a package that one of our own policies needs is not installed.
    """

    def __init__(self, hosts: HostAddress, spec: str, seed: int, *, alone: bool = False) -> None:
        self._spec = spec
        self.metadata: dict[str, JsonValue] = {}
        self.waited_s = self.latency_s = 0.0
        self.version = "unknown"
        self._reads: tuple[str, ...] = ()
        self._demonstration: Demonstration = {}
        self._sent: Payload = pack_payload(None)
        self._seconds = 0.0
        self._is_open = True
        with contextlib.ExitStack() as undo:
            self._block = SharedMemory(create=True, size=BLOCK_SIZE)
            undo.callback(self._block.close)
            # The host opens it in the first call, so it needs its name no longer: however this
            # process ends, nothing is left behind.
            with contextlib.ExitStack() as named:
                named.callback(self._block.unlink)
                self._connection = _connect(hosts)
                undo.callback(self._connection.close)
                call = {"spec": spec, "seed": seed, "alone": alone, "block": self._block.name}
                found = self._call("open", call)
            self.is_privileged = found.get("privileged") is True
            if not self.is_privileged:
                self._take_description(found)
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
        self._take_metadata(self._call("reset", self._pack(value)))

    def act(self, observation: Observation) -> NDArray[np.float64]:
        """Return the next actions (n, 8) or (n, 7)."""
        found = self._call("act", self._pack(observation))
        with _reading():
            self.latency_s = float(found["latency_s"])
            return np.frombuffer(found["rows"], np.float64).reshape(-1, found["size"]).copy()

    def hear(self, text: str, step: int) -> None:
        """Tell the policy what was said."""
        self._take_metadata(self._call("hear", {"utterances": [{"text": text, "step": step}]}))

    def usage(self) -> dict[str, float]:
        """Return the cost of the episode; empty after an error."""
        found = self._call("usage", {}) if self._is_open else {}
        with _reading():
            return {str(name): float(cost) for name, cost in found.get("usage", {}).items()}

    def close(self) -> None:
        """End the episode; repeated calls do nothing."""
        is_open, self._is_open = self._is_open, False
        with self._end, contextlib.suppress(EpisodeLostError):  # what is lost needs no end
            if is_open:
                self._call("close", {})

    def _call(self, method: str, call: Message) -> Message:
        """Call the host, draw what it asks for, and return the reply.

        Raises:
            EpisodeError: the policy raised, or broke its process.
            EpisodeLostError: the process was lost through no fault of this episode.
            MissingDependencyError: a package that one of our own policies needs is missing.
        """
        start = time.perf_counter()
        try:
            self._connection.send_bytes(encode({**call, "method": method}))
            while True:
                reply = decode(self._connection.recv_bytes())
                if "want" in reply:
                    answer = self._draw(reply["want"])
                elif "want_from" in reply:
                    self._copy(int(reply["want_from"]))
                    answer = {}
                else:
                    break
                self._connection.send_bytes(encode({**answer, "method": "answer"}))
        except (EOFError, OSError) as error:
            self._is_open = False
            raise _lost() from error
        except EpisodeError:
            self._is_open = False  # the host waits for an answer
            raise
        _print(reply.get("output"))
        found = self._result(reply)
        self.waited_s += max(time.perf_counter() - start - self._seconds, 0.0)
        return found

    def _result(self, reply: Message) -> Message:
        with _reading():
            if "lost" in reply:
                self._is_open = False
                kind, message, alone = reply["lost"]
                raise EpisodeLostError(kind, str(message), alone=bool(alone))
            if "error" in reply:
                kind, message, details = map(str, reply["error"])
                message = clip_text(message, _MAX_TEXT_LENGTH)
                if kind == MISSING and is_url(self._spec):
                    raise MissingDependencyError(message)
                known = kind if kind in ERROR_KINDS else "policy"
                # A process that broke is gone; a policy that raised is still there to be closed.
                self._is_open = bool(details)
                raise EpisodeError(known, message, clip_text(details, MAX_DETAILS_LENGTH))
            self._seconds = float(reply.get("seconds", 0.0))
            value = reply["value"]
            if not isinstance(value, dict):
                raise TypeError(type(value).__name__)
            return value

    def _take_description(self, found: Message) -> None:
        with _reading():
            PolicyNeeds(**found["needs"]).declare_on(self)
            self.version = clip_text(str(found["version"]), _MAX_TEXT_LENGTH)
            self._reads = tuple(map(str, found["reads"]))

    def _take_metadata(self, found: Message) -> None:
        with _reading():
            self.metadata = json.loads(json.dumps(dict(found["metadata"])))

    def _draw(self, fields: Any) -> Message:  # noqa: ANN401 - as a policy's process sent it
        with _reading():
            wanted = [field for field in self._demonstration if field in list(fields)]
        with attribute_errors("environment"):
            return self._pack(self._drawn(wanted))

    def _drawn(self, fields: Sequence[str]) -> dict[str, NDArray[Any]]:
        draw = getattr(self._demonstration, "draw", None)
        drawn = [field for field in fields if field.endswith(_DRAWN)]
        everything = sum(field.endswith(_DRAWN) for field in self._demonstration)
        if draw is not None and len(drawn) == everything > 1:
            draw()  # all cameras in one replay
        return {field: self._demonstration[field] for field in fields}

    def _pack(self, value: Mapping[str, Any]) -> Message:
        """Put the arrays of a value into shared memory; return the rest for the message."""
        self._sent = pack_payload(value)
        self._copy(0)
        return {"tree": self._sent.tree, "size": self._sent.size}

    def _copy(self, start: int) -> None:
        self._sent.copy_to(buffer_of(self._block), start)


def _print(output: object) -> None:
    """Print what the policy printed, so that it is in the log of its episode."""
    if output and isinstance(output, bytes):
        with contextlib.suppress(OSError):
            sys.stderr.flush()
            os.write(sys.__stderr__.fileno() if sys.__stderr__ else 2, output)


def _connect(hosts: HostAddress) -> Connection:
    try:
        connection = Client(hosts.path, "AF_UNIX")
        connection.send_bytes(hosts.key)
    except OSError as error:
        raise _lost() from error
    return connection


def _lost() -> EpisodeLostError:
    return EpisodeLostError("infrastructure", "the policy's host is gone", alone=False)


@contextlib.contextmanager
def _reading() -> Iterator[None]:
    """Turn what goes wrong while a reply is read into an error of the policy."""
    try:
        yield
    except (AttributeError, KeyError, TypeError, ValueError) as error:
        message = f"the policy's process sent a malformed reply ({type(error).__name__})"
        raise EpisodeError("policy", message, "") from error
