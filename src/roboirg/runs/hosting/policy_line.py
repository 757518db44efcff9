"""The world's end of a line into a policy's process: one call after the other, each within a limit.

A call that breaks the process, or exceeds its limit, is to blame for that. All that the process had
not begun is lost with it, and is played again: no verdict depends on who shared a process.
"""

from __future__ import annotations

import contextlib
import socket
import time
from collections.abc import Callable, Iterator, Mapping
from typing import NamedTuple

import msgspec

from roboirg.core.errors import RoboIRGError
from roboirg.core.field_types import MOST_SECONDS
from roboirg.core.policy_ref import PolicyRef
from roboirg.core.waiting import waiting
from roboirg.records.record import ErrorKind
from roboirg.runs.episode_errors import EpisodeError, EpisodeLostError
from roboirg.runs.hosting.messages import (
    MAX_MESSAGE,
    Begun,
    Call,
    HostRequest,
    Loss,
    Outcome,
    Question,
    ask,
    new_line,
    read_child,
    receive,
    send,
)

MAX_BEGUN = 64
"""Most bytes of a `Begun`."""
MOST_QUESTIONS = 64
"""How often a call may ask for the video of an episode; a field is kept once it is read."""
MAX_WORDS = 300
"""Most characters of the error for a reply that is not valid."""
PHASES: Mapping[str, str] = {
    "describe": "policy's constructor",
    "open": "policy's constructor",
    "reset": "policy's reset()",
    "act": "policy's act()",
    "hear": "policy's hear()",
    "usage": "policy's close()",
    "close": "policy's close()",
}

AnswerQuestion = Callable[[Question], Call]
"""Returns the world's answer to a question of the policy's process."""


class _Fault(NamedTuple):
    """What a policy's process did wrong: the kind of error, and words for its cause."""

    kind: ErrorKind
    words: str


class PolicyLine:
    """A line into a policy's process, for one episode.

    Args:
        hosts: the line on which to ask for that process, of `HostPool.connect`.
        policy: that the process plays.
        limit_s: how long a call may take, without its wait for others, which the supervisor limits,
            and without the time that the world takes to answer; None for no limit.
        alone: whether it must not be asked about this episode together with others.

    Attributes:
        output: what the policy printed in the last call.

    Raises:
        EpisodeLostError: the supervisor is gone.
    """

    def __init__(
        self,
        hosts: socket.socket,
        policy: PolicyRef,
        limit_s: float | None = None,
        *,
        alone: bool = False,
    ) -> None:
        self._hosts = hosts
        self._alone = alone
        self._limit_s = limit_s or MOST_SECONDS
        self.output = b""
        self._sent_at = 0.0
        self._until = 0.0
        self._line, theirs = new_line()
        with theirs, _supervised():
            ask(hosts, HostRequest("open", policy), theirs)

    def call(self, call: Call, answer: AnswerQuestion | None = None) -> Outcome:
        """Carry out a call in the policy's process; return its outcome, maybe the policy's error.

        The process serves several episodes, one call after the other: this call waits for its turn,
        is begun, and then has the time limit for itself. When it fails decides whose fault it is:

        =============================  =========================  ==================================
        what happens                   before the call is begun   afterwards
        =============================  =========================  ==================================
        the time is over               EpisodeError               EpisodeError
        the process ends by itself     EpisodeLostError           EpisodeError
        it is ended for another one    EpisodeLostError           EpisodeLostError
        it sends something else        EpisodeLostError           EpisodeError
        the policy raises              (cannot be)                an outcome with `error`
        =============================  =========================  ==================================

        An episode that is lost (EpisodeLostError) is played again. So is one whose call was begun
        together with those of other episodes, whatever happens but a wait in vain for its turn.
        After any exception the line is closed, but for an outcome with `error` of several.

        Args:
            call: method of the policy, with its arguments.
            answer: returns the world's answer to a question of the process; None if the call may
                ask nothing.

        Raises:
            EpisodeError: this call broke the process or took too long, or the process did not
                begin it.
            EpisodeLostError: the process was lost through no fault of this episode, or a call for
                several episodes failed.
        """
        begun: Begun | None = None  # until the process begins the call
        phase = PHASES[call.method]
        self.output = b""
        try:
            begun = self._begin(call)
            outcome = self._outcome(answer)
        except TimeoutError:
            words = f"the {phase} did not return within {self._limit_s:g} s"
            if begun is None:  # an honest process begins the call that has waited longest
                words = f"the process did not begin the {phase}, though it was its turn"
            raise self._loss_error(begun or Begun(), phase, _Fault("timeout", words)) from None
        except (EOFError, OSError):
            raise self._loss_error(begun, phase) from None
        except (KeyboardInterrupt, SystemExit):  # the call goes on, so none can follow
            self.close()
            raise
        except (RoboIRGError, RecursionError, ValueError) as error:
            complaint = f"the process sent no valid reply ({error})"
            words = f"{complaint[:MAX_WORDS]} in the {phase}"
            if begun is None:  # a call of another episode may be under way
                self.close()
                raise EpisodeLostError("policy", words) from None
            raise self._loss_error(begun, phase, _Fault("policy", words)) from None
        self.output = outcome.output
        if outcome.error is not None and begun.together:
            words = "a call for several episodes failed"
            raise EpisodeLostError("policy", words, alone=True)
        return outcome

    @property
    def is_open(self) -> bool:
        """Whether the policy can be called: it is not closed, and its process was not lost."""
        return self._line.fileno() >= 0

    def close(self) -> None:
        """End the episode; repeated calls do nothing."""
        if self.is_open:
            self._line.close()
            with contextlib.suppress(OSError):
                ask(self._hosts, HostRequest("leave"))

    def _begin(self, call: Call) -> Begun:
        """Send a call, and wait until the process begins it, as other episodes may come first.

        Returns:
            Whether the call was begun alone or in a batch with those of other episodes.

        Raises:
            ValueError: the process has sent something else.
        """
        self._sent_at = time.monotonic()
        self._until = self._sent_at + self._limit_s
        with waiting("its turn in the policy's process", is_queue=True):
            send(self._line, call, self._seconds_for_turn)
            begun = read_child(receive(self._line, MAX_BEGUN, self._seconds_for_turn))
        if not isinstance(begun, Begun) or (begun.together and self._alone):
            raise ValueError("a message that was not asked for")
        return begun

    def _seconds_for_turn(self) -> float:
        """Return the seconds for which a call may still wait until its process begins it.

        When the limit of a call is over, the supervisor checks that the process does not hang. If
        it does not, calls of other episodes came first. Then the wait is extended: by the limit
        again, but not beyond the time that the supervisor allows in all.

        Raises:
            EOFError: the process is over.
            TimeoutError: the call has waited too long for its turn.
        """
        if time.monotonic() >= self._until:
            ask(self._hosts, HostRequest("check", limit_s=self._limit_s))
            most_s = msgspec.msgpack.decode(receive(self._hosts), type=float | None)
            if most_s is None:
                raise EOFError
            self._until = min(time.monotonic() + self._limit_s, self._sent_at + most_s)
        return self._seconds_left()

    def _outcome(self, answer: AnswerQuestion | None) -> Outcome:
        """Wait for the outcome of a call that has begun, and return it.

        Meanwhile the process may ask for pictures of the demonstration, which `answer` draws. The
        time for that does not count for the limit of the call.

        Raises:
            ValueError: the process sends something else, or asks too often.
        """
        self._until = time.monotonic() + self._limit_s
        for _ in range(MOST_QUESTIONS + 1):
            reply = read_child(receive(self._line, MAX_MESSAGE, self._seconds_left))
            if isinstance(reply, Outcome):
                return reply
            if answer is None or not isinstance(reply, Question):
                raise ValueError("a message that was not asked for")
            asked_at = time.monotonic()
            answered = answer(reply)
            self._until += time.monotonic() - asked_at  # drawing is not the policy's time
            send(self._line, answered, self._seconds_left)
        raise ValueError("it asked for the video again and again")

    def _seconds_left(self) -> float:
        """Return the seconds until the limit.

        Raises:
            TimeoutError: there are none.
        """
        left_s = self._until - time.monotonic()
        if left_s <= 0:
            raise TimeoutError
        return left_s

    def _loss_error(
        self, begun: Begun | None, phase: str, fault: _Fault | None = None
    ) -> Exception:
        """Return the error to raise for a process that was lost during a call; close the line.

        A call is to blame if the process had begun it, and it alone: then the episode ends with an
        `EpisodeError`. Otherwise the episode can be played again: an `EpisodeLostError`.

        Args:
            begun: the process's message that the call begins; None if it has not begun.
            phase: of the call, in words.
            fault: of the process, which is killed for it; None if it has ended by itself.
        """
        with contextlib.closing(self), _supervised():
            if fault is not None:
                ask(self._hosts, HostRequest("kill"))
            ask(self._hosts, HostRequest("loss"))
            loss = msgspec.msgpack.decode(receive(self._hosts), type=Loss)
        was_ended_for_others = loss.was_ended and fault is None
        if begun is None or was_ended_for_others:
            return EpisodeLostError(loss.kind, loss.words)
        self.output = loss.output
        if fault is None:
            fault = _Fault(loss.kind, f"{loss.words} in the {phase}")
        if begun.together:
            return EpisodeLostError(fault.kind, fault.words, alone=True)
        return EpisodeError(fault.kind, fault.words, "")


@contextlib.contextmanager
def _supervised() -> Iterator[None]:
    """Turn the loss of the supervisor into an `EpisodeLostError`."""
    try:
        yield
    except (EOFError, OSError) as error:
        raise EpisodeLostError("infrastructure", "the policy's host is gone") from error
