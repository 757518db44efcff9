"""Deliveries: when each utterance of an instruction is said, and whether it is heard."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal, NamedTuple

from roboirg.core.instruction_options import DEFAULT_DELIVERY

TURNS = "turns"
DELIVERIES = (DEFAULT_DELIVERY, TURNS)

PromptVerdict = Literal["heard", "cut", "unknown"]
"""Whether all that was said reached a policy's language model, or its prompt was cut."""

SPACING = 20
"""Control steps between two utterances: one second."""
LATEST = 40
"""Latest control step of the command; more utterances follow each other faster.

A later one could not be followed in StopCube, whose earliest press begins at step 60.
"""


class HeardUtterance(NamedTuple):
    """An utterance that the policy has heard.

    Attributes:
        text: its words.
        step: control step of the policy's turn at which it was heard; 0 is before its first step,
            and after the video if there is one.
    """

    text: str
    step: int


def utterance_steps(count: int, delivery: str) -> tuple[int, ...]:
    """Return the control step of the policy's turn at which each of `count` utterances is said."""
    if delivery != TURNS or count < 2:  # noqa: PLR2004 - one utterance has no other to wait for
        return (0,) * count
    return tuple(min(turn * SPACING, turn * LATEST // (count - 1)) for turn in range(count))


class SpokenInstruction:
    """The utterances of one episode and which of them the policy has heard.

    Attributes:
        heard: what the policy has heard, in order.
        prompt: the words heard last. An observation that comes after several utterances brings
            all of them.
    """

    def __init__(self, turns: Sequence[str], delivery: str) -> None:
        self._schedule = tuple(zip(utterance_steps(len(turns), delivery), turns, strict=True))
        self.heard: list[HeardUtterance] = []
        self.prompt = ""
        self.hear(0)

    @property
    def unheard(self) -> int:
        """Number of utterances that the policy has not heard yet."""
        return len(self._schedule) - len(self.heard)

    def hear(self, step: int) -> None:
        """Hear what has been said up to a control step; call at every observation."""
        new = [text for said, text in self._schedule[len(self.heard) :] if said <= step]
        if new:
            self.heard += [HeardUtterance(text, step) for text in new]
            self.prompt = " ".join(new)

    def said_at(self, step: int) -> str:
        """Return the words said last at a control step, whether the policy observed it or not."""
        last = max(said for said, _ in self._schedule if said <= step)
        return " ".join(text for said, text in self._schedule if said == last)
