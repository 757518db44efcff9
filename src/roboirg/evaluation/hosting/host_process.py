"""The policy's process: carries out the calls of many episodes, one after the other.

It holds nothing of a world but what the contract gives to a policy: instruction, video,
observations. It is started with a clean interpreter, and its only way out is one socket.
"""

from __future__ import annotations

import contextlib
import functools
import io
import os
import sys
import threading
from collections.abc import Sequence
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

from roboirg.core.errors import MissingDependencyError
from roboirg.evaluation.episode_errors import describe_error, one_line
from roboirg.evaluation.hosting.hosted_episode import HostedEpisode
from roboirg.evaluation.hosting.messages import (
    MAX_TEXT,
    Ask,
    Call,
    Failure,
    Opened,
    Outcome,
    encode,
    read_call,
    read_calls,
    receive_descriptor,
)
from roboirg.policies.by_name.loading import policy_needs, policy_version
from roboirg.policies.contract.random_state import RandomState


class HostProcess:
    """Carries out calls until the connection closes.

    Args:
        connection: to the supervisor.
    """

    def __init__(self, connection: Connection) -> None:
        self._connection = connection
        self._episodes: dict[int, HostedEpisode] = {}
        self._read_fields: dict[str, None] = {}
        self._asking: set[int] = set()
        self._home, self._thread = os.getcwd(), threading.get_ident()  # noqa: PTH109

    def serve(self) -> None:
        """Answer every message."""
        with contextlib.suppress(EOFError, OSError):
            while True:
                calls = read_calls(self._connection.recv_bytes())
                self._connection.send_bytes(encode(self._answer(calls)))

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
        # What belongs to the next call is not left in the socket, whatever happens in this one.
        block = receive_descriptor(self._connection) if call.method == "open" else -1
        try:
            return self._carry_out(call, block)
        except BaseException as error:  # noqa: BLE001 - policies may raise anything
            return _failure(error)

    def _carry_out(self, call: Call, block: int) -> Outcome:
        if call.method == "describe":
            return Opened(policy_needs(call.spec), policy_version(call.spec))
        if call.method == "open":
            ask = functools.partial(self.ask, call.session)
            episode = HostedEpisode(call, block, ask, self._read_fields)
            self._episodes[call.session] = episode
            return episode.describe(call.spec)
        episode = self._episodes[call.session]
        if call.method == "close":
            del self._episodes[call.session]
        with episode.random:
            found: Outcome = getattr(episode, call.method)(call)
        return found

    def _act_together(self, calls: Sequence[Call]) -> list[Outcome]:
        """Ask about several episodes at once; a failure is not attributed to any of them."""
        episodes = [self._episodes[call.session] for call in calls]
        try:
            observations = [one.read(call) for one, call in zip(episodes, calls, strict=True)]
            first: Any = episodes[0].policy
            RandomState.set_aside()
            chunks = first.act_together([one.policy for one in episodes], observations)
            return [one.actions(rows) for one, rows in zip(episodes, chunks, strict=True)]
        except BaseException as error:  # noqa: BLE001 - policies may raise anything
            return [_failure(error)] * len(calls)

    def ask(self, session: int, question: Ask) -> Call:
        """Ask the world of an episode whose call is under way.

        Raises:
            RuntimeError: no call of this episode is under way in this thread, or the world is gone.
        """
        if session not in self._asking or threading.get_ident() != self._thread:
            raise RuntimeError(
                "pictures of the demonstration can be read only while a call of the policy is "
                "under way, by the thread that was called"
            )
        question.session = session
        self._connection.send_bytes(encode(question))
        answer = read_call(self._connection.recv_bytes())
        if answer.method == "gone":
            raise RuntimeError("the episode has ended")
        return answer


def _failure(error: BaseException) -> Failure:
    """Return kind, message and traceback of an exception that is being handled."""
    if isinstance(error, MissingDependencyError):
        return Failure("missing", one_line(error))
    try:
        found = describe_error("policy", error)
    except BaseException:  # noqa: BLE001 - its attributes are a policy's code, too
        return Failure("policy", "it raised an exception that cannot be described")
    kind: Any = found.kind  # of the policy, never of the environment
    return Failure(kind, str(found)[:MAX_TEXT], found.details)


def main(connection: Connection) -> None:
    """Serve a supervisor; runs in a process of its own."""
    if isinstance(sys.stdout, io.TextIOWrapper):
        sys.stdout.reconfigure(line_buffering=True)
    if sys.path[-1] == str(Path.cwd()):  # where a command puts it: its policy's files come first
        sys.path.insert(0, sys.path.pop())
    HostProcess(connection).serve()
    with contextlib.suppress(Exception):
        sys.stdout.flush()
    os._exit(0)  # threads that a policy left behind must not keep this process
