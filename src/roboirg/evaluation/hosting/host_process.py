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
import time
from collections.abc import Sequence
from dataclasses import asdict
from multiprocessing.connection import Connection
from typing import Any

from roboirg.core.errors import MissingDependencyError
from roboirg.evaluation.episode_errors import describe_error, one_line
from roboirg.evaluation.hosting.hosted_episode import HostedEpisode
from roboirg.evaluation.hosting.payload import Message, decode, encode
from roboirg.policies.by_name.loading import is_privileged, policy_needs, policy_version
from roboirg.policies.contract.random_state import RandomState

MISSING = "missing"
"""Instead of a kind of error: a package is not installed."""


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
                message = decode(self._connection.recv_bytes())
                self._connection.send_bytes(encode(self._answer(message)))

    def _answer(self, message: Message) -> Message:
        method, calls = message["method"], message["calls"]
        with contextlib.suppress(OSError):
            os.chdir(self._home)  # an earlier episode may have changed it
        self._asking = {call["session"] for call in calls}
        start = time.perf_counter()
        if method == "act" and len(calls) > 1:
            results = self._act_together(calls)
        else:
            results = [self._result(call, method) for call in calls]
        self._asking = set()
        seconds = time.perf_counter() - start
        for stream in (sys.stdout, sys.stderr):
            with contextlib.suppress(Exception):  # a policy may have closed or replaced it
                stream.flush()
        return {"results": results, "seconds": seconds}

    def _result(self, call: Message, method: str) -> Message:
        try:
            return {"value": self._carry_out(call, method)}
        except BaseException as error:  # noqa: BLE001 - policies may raise anything
            return {"error": _error(error)}

    def _carry_out(self, call: Message, method: str) -> Message:
        session: int = call["session"]
        if method == "describe":
            return {
                "needs": asdict(policy_needs(call["spec"])),
                "version": policy_version(call["spec"]),
                "privileged": is_privileged(call["spec"]),
            }
        if method == "open":
            if is_privileged(call["spec"]):
                return {"privileged": True}  # its place is beside the world
            ask = functools.partial(self.ask, session)
            episode = HostedEpisode(call, ask, self._read_fields)
            self._episodes[session] = episode
            return episode.describe(call["spec"])
        episode = self._episodes[session]
        if method == "close":
            del self._episodes[session]
        with episode.random:
            found: Message = getattr(episode, method)(call)
        return found

    def _act_together(self, calls: Sequence[Message]) -> list[Message]:
        """Ask about several episodes at once; a failure is not attributed to any of them."""
        episodes = [self._episodes[call["session"]] for call in calls]
        try:
            observations = [
                one.observation(call) for one, call in zip(episodes, calls, strict=True)
            ]
            first: Any = episodes[0].policy
            RandomState.set_aside()
            chunks = first.act_together([one.policy for one in episodes], observations)
            return [
                {"value": one.actions(rows)} for one, rows in zip(episodes, chunks, strict=True)
            ]
        except BaseException as error:  # noqa: BLE001 - policies may raise anything
            return [{"error": _error(error)}] * len(calls)

    def ask(self, session: int, question: Message) -> Message:
        """Ask the world of an episode whose call is under way.

        Raises:
            RuntimeError: no call of this episode is under way in this thread, or the world is gone.
        """
        if session not in self._asking or threading.get_ident() != self._thread:
            raise RuntimeError(
                "pictures of the demonstration can be read only while a call of the policy is "
                "under way, by the thread that was called"
            )
        self._connection.send_bytes(encode({**question, "session": session}))
        answer = decode(self._connection.recv_bytes())
        if answer.get("gone"):
            raise RuntimeError("the episode has ended")
        return answer


def _error(error: BaseException) -> list[str]:
    """Return kind, message and traceback of an exception that is being handled."""
    if isinstance(error, MissingDependencyError):
        return [MISSING, one_line(error), ""]
    try:
        found = describe_error("policy", error)
    except BaseException:  # noqa: BLE001 - its attributes are a policy's code, too
        return ["policy", "it raised an exception that cannot be described", ""]
    return [found.kind, str(found), found.details]


def main(connection: Connection) -> None:
    """Serve a supervisor; runs in a process of its own."""
    if isinstance(sys.stdout, io.TextIOWrapper):
        sys.stdout.reconfigure(line_buffering=True)
    HostProcess(connection).serve()
    with contextlib.suppress(Exception):
        sys.stdout.flush()
    os._exit(0)  # threads that a policy left behind must not keep this process
