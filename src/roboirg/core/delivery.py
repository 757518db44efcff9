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
    """Return the control step of the policy's turn at which each of `count` utterances is said.

    With the delivery ``prompt`` all are said at 0. With ``turns``, three are said at 0, 20 and 40,
    and five, which must fit into the same time, at 0, 10, 20, 30 and 40.
    """
    if delivery != TURNS or count < 2:  # noqa: PLR2004 - one utterance has no other to wait for
        return (0,) * count
    steps = []
    for turn in range(count):
        # The first at 0, the last, which is the command, at `LATEST`.
        evenly_spread = turn * LATEST // (count - 1)
        steps.append(min(turn * SPACING, evenly_spread))
    return tuple(steps)


class SpokenInstruction:
    """The utterances of one episode and which of them the policy has heard.

    Utterances are heard in order, and each once; `hear` is called with steps that never decrease.

    Attributes:
        heard: what the policy has heard, in order.
        prompt: the words heard last. An observation that comes after several utterances brings all
            of them.
    """

    def __init__(self, turns: Sequence[str], delivery: str) -> None:
        """Schedule the utterances; hear what is said at step 0."""
        steps = utterance_steps(len(turns), delivery)
        self._schedule = tuple(zip(steps, turns, strict=True))
        self.heard: list[HeardUtterance] = []
        self.prompt = ""
        self.hear(0)

    @property
    def unheard(self) -> int:
        """Number of utterances that the policy has not heard yet."""
        return len(self._schedule) - len(self.heard)

    def hear(self, step: int) -> None:
        """Hear what has been said up to a control step; call at every observation.

        `prompt` becomes the new utterances, joined; it stays as it is if nothing new was said.
        """
        unheard = self._schedule[len(self.heard) :]
        new_texts = [text for said_at, text in unheard if said_at <= step]
        if new_texts:
            self.heard += [HeardUtterance(text, step) for text in new_texts]
            self.prompt = " ".join(new_texts)

    def said_at(self, step: int) -> str:
        """Return the words said last at or before a control step, heard or not.

        Utterances that are said at the same step are joined. Nothing changes.
        """
        last = max(said_at for said_at, _ in self._schedule if said_at <= step)
        return " ".join(text for said_at, text in self._schedule if said_at == last)
