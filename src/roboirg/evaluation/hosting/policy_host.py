"""The host of one policy: its process, and the turns in which episodes are asked about.

A call that breaks the process costs its own episode. The other episodes of that process, and those
asked about together with it, are played again: no verdict depends on who shared a host.

Each episode has a thread. The one whose call waits longest carries it out, and with it the calls of
others that can be carried out together.
"""

from __future__ import annotations

import itertools
import socket
import threading
import time
from collections import deque
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

from roboirg.evaluation.episode_errors import EpisodeLostError
from roboirg.evaluation.hosting.messages import (
    Call,
    Outcome,
    Question,
    Reply,
    receive_calls,
    send,
)
from roboirg.evaluation.hosting.policy_child import PolicyChild
from roboirg.util.child_process import GRACE_S
from roboirg.util.deadline_watch import DeadlineWatch

GATHER_S = 0.003
"""How long a call waits for others that could be carried out together with it."""

MOST_QUESTIONS = 64
"""How often a call may ask for the video of an episode; a field is kept once it is read."""

PHASES: Mapping[str, str] = {
    "open": "policy's constructor",
    "reset": "policy's reset()",
    "act": "policy's act()",
    "hear": "policy's hear()",
    "usage": "policy's close()",
    "close": "policy's close()",
}
_ENDING = EpisodeLostError("infrastructure", "the run is ending")
_numbers = itertools.count(1)


@dataclass(eq=False)
class HostSession:
    """An episode that a host serves.

    Attributes:
        line: to its world.
        alone: whether it must not be asked about together with others.
        number: unique in this process.
        started: which of the host's processes serves it; 0 before it is open.
        together: whether its policy can be asked about several episodes at once.
        call: the latest.
        reply: to it; None while it waits or is under way.
    """

    line: socket.socket
    alone: bool = False
    number: int = field(default_factory=lambda: next(_numbers))
    started: int = 0
    together: bool = False
    call: Call = field(default_factory=lambda: Call("open"))
    reply: Reply | None = None


class PolicyHost:
    """Runs one policy process for many worlds, and starts it again when it dies.

    Args:
        start: starts the process.
        batch: most episodes that are asked about together.
        timeout_s: how long a call may take, without the time in the queue; None for no limit.

    Attributes:
        sessions: the episodes it serves.
        child: the policy's process; None if there is none.
    """

    def __init__(
        self, start: Callable[[], PolicyChild], batch: int, timeout_s: float | None
    ) -> None:
        self._start, self._batch, self._timeout_s = start, batch, timeout_s
        self.sessions: set[HostSession] = set()
        self.child: PolicyChild | None = None
        self._waiting: deque[HostSession] = deque()
        self._changed = threading.Condition()
        self._is_busy = self._is_stopped = False
        self._starts, self._loss = 0, _ENDING
        self._limit = DeadlineWatch(self._kill)
        self._limit.__enter__()

    def call(self, session: HostSession, call: Call) -> Reply:
        """Carry out a call of a world and return the reply; called by the session's thread."""
        call.session = session.number
        session.call, session.reply = call, None
        with self._changed:
            self._waiting.append(session)
            self._changed.notify_all()
            done = self._changed.wait_for(lambda: session.reply or self._is_next(session))
            if isinstance(done, Reply):  # carried out with the call of another
                return done
            self._waiting.popleft()
            self._is_busy = True
            calls = self._gather(session)
        replies = [Reply(message="the policy's host failed", again=True)]
        try:
            replies = self._carry_out(calls)
        finally:
            with self._changed:
                for one, reply in zip(calls, itertools.cycle(replies), strict=False):
                    one.reply = reply
                self._is_busy = False
                self._changed.notify_all()
        return replies[0]

    def leave(self, session: HostSession) -> None:
        """End an episode whose world may be gone."""
        if session.started:
            self.call(session, Call("close"))
        self.sessions.discard(session)

    def stop(self) -> None:
        """End the process; what is under way is lost."""
        self._is_stopped = True
        if (child := self.child) is not None:
            child.end()
        self._limit.__exit__()

    def _kill(self) -> None:
        if (child := self.child) is not None:
            child.kill()

    def _is_next(self, session: HostSession) -> bool:
        return not self._is_busy and self._waiting[0] is session

    def _gather(self, first: HostSession) -> list[HostSession]:
        """Wait for calls that can be carried out together with one; holds the condition."""
        if not self._joins(first):
            return [first]
        # Worlds that wait already, and those that are just about to.
        wanted = min(self._batch, sum(not one.alone for one in tuple(self.sessions)))
        self._changed.wait_for(lambda: len(self._waiting) + 1 >= wanted, GATHER_S)
        joining = [one for one in self._waiting if self._joins(one)][: self._batch - 1]
        for one in joining:
            self._waiting.remove(one)
        return [first, *joining]

    def _joins(self, session: HostSession) -> bool:
        can_join = session.together and not session.alone and session.started == self._starts
        return can_join and session.call.method == "act"

    def _carry_out(self, sessions: Sequence[HostSession]) -> list[Reply]:
        """Carry out the calls of sessions that are asked about together, mostly one."""
        if self.child is not None and (loss := self.child.loss(GRACE_S)) is not None:
            self._forget_child(loss)
        first = sessions[0]
        method = first.call.method
        # Those that join others are of the process that is alive.
        if self._is_stopped or (method != "open" and first.started != self._starts):
            loss = _ENDING if self._is_stopped else self._loss
            return [_again(loss) if method != "close" else Reply(Outcome())] * len(sessions)
        self._limit.acted_after = None
        try:
            outcomes, seconds = self._exchange(sessions)
        except EpisodeLostError as loss:
            return self._attribute(sessions, loss)
        printed = b"" if self.child is None else self.child.take_output()
        if len(sessions) > 1 and any(one.error is not None for one in outcomes):
            failed = EpisodeLostError("policy", "a call for several episodes failed")
            return [_again(failed, alone=True)] * len(sessions)
        if method == "open" and outcomes[0].error is None:
            first.started, first.together = self._starts, outcomes[0].together
        elif method == "close":
            first.started = 0
        # What a call for several episodes prints is of all of them.
        return [Reply(one, seconds, printed) for one in outcomes]

    def _exchange(self, sessions: Sequence[HostSession]) -> tuple[list[Outcome], float]:
        """Send calls to the process, and return the outcomes and the seconds that it took."""
        child = self._started_child()
        by_number = {session.number: session for session in sessions}
        calls = [session.call for session in sessions]
        spent_s = 0.0
        for _ in range(MOST_QUESTIONS * len(sessions)):
            start = time.monotonic()
            self._limit.begin(None if self._timeout_s is None else self._timeout_s - spent_s)
            try:
                reply = child.exchange(calls)
            finally:
                self._limit.begin(None)
                spent_s += time.monotonic() - start
            if isinstance(reply, list):
                if len(reply) != len(sessions):
                    raise EpisodeLostError("policy", "the process sent too few or too many results")
                return reply, spent_s
            if reply.session not in by_number:
                raise EpisodeLostError(
                    "policy", "the process asked for the video of another episode"
                )
            # What the world takes to draw is not the policy's time.
            calls = [_ask(by_number[reply.session], reply)]
        raise EpisodeLostError("policy", "the process asked for the video again and again")

    def _started_child(self) -> PolicyChild:
        if self.child is None:
            self.child, self._starts = self._start(), self._starts + 1
            if self._is_stopped:
                self._kill()
            # The start of the interpreter is not the policy's time.
            self.child.exchange([])
        return self.child

    def _forget_child(self, loss: EpisodeLostError) -> None:
        """Give up a process that is dead; the episodes that it served are played again."""
        if self.child is not None:
            self.child.end()
        self.child, self._starts, self._loss = None, self._starts + 1, loss

    def _attribute(self, sessions: Sequence[HostSession], loss: EpisodeLostError) -> list[Reply]:
        """Attribute the loss of the process to the call that was under way."""
        printed = b""
        if self.child is not None:
            self.child.kill()
            printed = self.child.take_output(GRACE_S)
        self._forget_child(loss)
        phase = PHASES[sessions[0].call.method]
        if len(sessions) > 1 or self._is_stopped:
            return [_again(loss, alone=not self._is_stopped)] * len(sessions)
        if self._limit.acted_after is not None:
            words = f"the {phase} did not return within {self._timeout_s:g} s"
            return [Reply(output=printed, kind="timeout", message=words)]
        return [Reply(output=printed, kind=loss.kind, message=f"{loss} in the {phase}")]


def _ask(session: HostSession, question: Question) -> Call:
    """Return the answer of a world."""
    try:
        send(session.line, question)
        (answer,) = receive_calls(session.line)
    except (EOFError, OSError):
        return Call("gone")
    return answer


def _again(loss: EpisodeLostError, *, alone: bool = False) -> Reply:
    return Reply(kind=loss.kind, message=str(loss), again=True, alone=alone)
