"""The host of one policy: a queue of calls in front of its process.

A call that breaks the process costs its own episode. The other episodes of that process, and those
asked about together with it, are played again: no record depends on which episodes shared a host.
"""

from __future__ import annotations

import itertools
import threading
import time
from collections import deque
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from multiprocessing.connection import Connection
from queue import SimpleQueue

from roboirg.evaluation.hosting.payload import Message, decode, encode
from roboirg.evaluation.hosting.policy_child import ChildLostError, PolicyChild
from roboirg.util.deadline_watch import DeadlineWatch

GATHER_S = 0.003
"""How long a call waits for others that could be carried out together with it."""

PHASES: Mapping[str, str] = {
    "open": "policy's constructor",
    "reset": "policy's reset()",
    "act": "policy's act()",
    "hear": "policy's hear()",
    "usage": "policy's close()",
    "close": "policy's close()",
}
_numbers = itertools.count(1)


@dataclass(eq=False)
class HostSession:
    """An episode that a host serves.

    Attributes:
        connection: to its world.
        alone: whether it must not be asked about together with others.
        number: unique in this process.
        started: which of the host's processes serves it; 0 before it is open.
        together: whether its policy can be asked about several episodes at once.
    """

    connection: Connection
    alone: bool = False
    number: int = field(default_factory=lambda: next(_numbers))
    started: int = 0
    together: bool = False


@dataclass(eq=False)
class _Call:
    """A call that waits or is under way.

    Attributes:
        session: its episode.
        message: as the world sent it.
        replies: questions to the world and the final reply; read by the session's thread.
        answers: the world's answers to questions; None if the world is gone.
        is_orphaned: whether the world is gone.
    """

    session: HostSession
    message: Message
    replies: SimpleQueue[Message] = field(default_factory=SimpleQueue)
    answers: SimpleQueue[Message | None] = field(default_factory=SimpleQueue)
    is_orphaned: bool = False


class PolicyHost:
    """Runs one policy process for many worlds, and starts it again when it dies.

    Args:
        variables: environment variables of the process.
        batch: most episodes that are asked about together.
        timeout_s: how long a call may take, without the time in the queue; None for no limit.

    Attributes:
        sessions: the episodes it serves.
        child: the policy's process; None if there is none.
    """

    def __init__(self, variables: Mapping[str, str], batch: int, timeout_s: float | None) -> None:
        self._variables, self._batch, self._timeout_s = dict(variables), batch, timeout_s
        self.sessions: set[HostSession] = set()
        self._waiting: deque[_Call] = deque()
        self._changed = threading.Condition()
        self._stopped = False
        self.child: PolicyChild | None = None
        self._starts = 0
        self._limit = DeadlineWatch(self._kill)
        self._loss = ChildLostError("infrastructure", "the run is ending")
        self._thread = threading.Thread(target=self._run, name="policy host", daemon=True)
        self._thread.start()

    def call(self, session: HostSession, message: Message) -> Message:
        """Carry out a call of a world and return the reply; called by the session's thread.

        Raises:
            EOFError: the world is gone.
            OSError: likewise.
        """
        call = _Call(session, message)
        with self._changed:
            self._waiting.append(call)
            self._changed.notify()
        while True:
            reply = call.replies.get()
            if "want" not in reply and "want_from" not in reply:
                return reply
            answer = None
            try:
                session.connection.send_bytes(encode(reply))
                answer = decode(session.connection.recv_bytes())
            finally:
                call.is_orphaned = answer is None
                call.answers.put(answer)

    def leave(self, session: HostSession) -> None:
        """End an episode whose world may be gone."""
        self.sessions.discard(session)
        if session.started:
            with self._changed:
                self._waiting.append(_Call(session, {"method": "close"}, is_orphaned=True))
                self._changed.notify()

    def stop(self) -> None:
        """End the process after the call that is under way."""
        with self._changed:
            self._stopped = True
            self._changed.notify()

    def join(self) -> None:
        """Stop now, and wait for it."""
        self.stop()
        if self.sessions:
            self._kill()
        self._thread.join()

    def _kill(self) -> None:
        if (child := self.child) is not None:
            child.kill()

    def _run(self) -> None:
        with self._limit:
            self._carry_out_all()
        for call in self._waiting:
            self._reply_lost(call)
        if self.child is not None:
            self.child.close()

    def _carry_out_all(self) -> None:
        while calls := self._gather():
            if self.child is not None and (loss := self.child.loss()) is not None:
                self._forget_child(loss)
            ready = [call for call in calls if self._is_current(call)]
            if ready:
                self._carry_out(ready)

    def _forget_child(self, loss: ChildLostError) -> None:
        """Give up a process that is dead; the episodes that it served are played again."""
        if self.child is not None:
            self.child.close()
        self.child, self._starts, self._loss = None, self._starts + 1, loss

    def _gather(self) -> list[_Call]:
        """Wait for a call and for others to go with it; empty when the host is stopped."""
        with self._changed:
            self._changed.wait_for(lambda: self._waiting or self._stopped)
            if self._stopped:
                return []
            first = self._waiting.popleft()
            if not self._joins(first):
                return [first]
            # Worlds that wait already, and those that are just about to.
            wanted = min(self._batch, sum(not one.alone for one in tuple(self.sessions)))
            self._changed.wait_for(lambda: len(self._waiting) + 1 >= wanted, GATHER_S)
            calls, left = [first], deque[_Call]()
            while self._waiting:
                call = self._waiting.popleft()
                joins = len(calls) < self._batch and self._joins(call)
                (calls if joins else left).append(call)
            self._waiting = left
            return calls

    def _joins(self, call: _Call) -> bool:
        session = call.session
        return (
            call.message["method"] == "act"
            and session.together
            and not session.alone
            and session.started == self._starts
        )

    def _is_current(self, call: _Call) -> bool:
        """Return whether the episode's process is alive; tell its world if not."""
        session, method = call.session, call.message["method"]
        if method == "open" or session.started == self._starts:
            return True
        if method == "close":
            call.replies.put({"value": {}})
        else:
            self._reply_lost(call)
        return False

    def _carry_out(self, calls: Sequence[_Call]) -> None:
        try:
            if self.child is None:
                self.child, self._starts = PolicyChild.start(self._variables), self._starts + 1
            reply = self._exchange(calls)
            results = reply["results"]
            # What a call for several episodes prints is of all of them.
            printed = self.child.printed.take()
            replies = [
                {**result, "seconds": reply["seconds"], "output": printed}
                for _, result in zip(calls, results, strict=True)
            ]
        except ChildLostError as loss:
            self._attribute(calls, loss)
            return
        except (AttributeError, KeyError, TypeError, ValueError) as error:
            self._attribute(calls, ChildLostError("policy", f"the process sent {error!r}"))
            return
        if len(calls) > 1 and any("error" in one for one in replies):
            failed = ChildLostError("policy", "a call for several episodes failed")
            for call in calls:
                self._reply_lost(call, failed, alone=True)
            return
        for call, one in zip(calls, replies, strict=True):
            method, session = call.message["method"], call.session
            if method == "open" and "needs" in one.get("value", {}):
                session.started = self._starts
                session.together = bool(one["value"]["together"])
            elif method == "close":
                session.started = 0
            call.replies.put(one)

    def _exchange(self, calls: Sequence[_Call]) -> Message:
        """Send calls to the process, pass on its questions, and return its reply."""
        child = self.child
        if child is None:
            raise AssertionError("the process has been started")
        message: Message = {
            "method": calls[0].message["method"],
            "calls": [{**call.message, "session": call.session.number} for call in calls],
        }
        by_number = {call.session.number: call for call in calls}
        left_s, self._limit.acted_after = self._timeout_s, None
        while True:
            start = time.monotonic()
            self._limit.begin(left_s)
            try:
                reply = child.exchange(message)
            finally:
                self._limit.begin(None)
            if "results" in reply:
                return reply
            if left_s is not None:  # what the world takes to draw is not the policy's time
                left_s -= time.monotonic() - start
            call = by_number[reply.pop("session")]
            if not call.is_orphaned:
                call.replies.put(reply)
            answer = None if call.is_orphaned else call.answers.get()
            message = answer or {"gone": True}

    def _attribute(self, calls: Sequence[_Call], loss: ChildLostError) -> None:
        """Attribute the loss of the process to the call that was under way."""
        printed = b""
        if self.child is not None:
            self.child.kill()
            printed = self.child.printed.take()
        self._forget_child(loss)
        for call in calls:
            phase = PHASES[call.message["method"]]
            if len(calls) > 1:
                self._reply_lost(call, loss, alone=True)
            elif self._limit.acted_after is not None:
                error = ["timeout", f"the {phase} did not return within {self._timeout_s:g} s", ""]
                call.replies.put({"error": error, "output": printed})
            else:
                error = [loss.kind, f"{loss} in the {phase}", ""]
                call.replies.put({"error": error, "output": printed})

    def _reply_lost(
        self, call: _Call, loss: ChildLostError | None = None, *, alone: bool = False
    ) -> None:
        loss = loss or self._loss
        call.replies.put({"lost": [loss.kind, str(loss), alone]})


def host_variables(device: str | None) -> dict[str, str]:
    """Return the environment variables of a host process on a device."""
    return {} if device is None else {"CUDA_VISIBLE_DEVICES": device}
