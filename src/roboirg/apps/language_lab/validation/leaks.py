"""No leak: an implicit command contains no hidden value, in any spelling."""

from __future__ import annotations

import re
from typing import cast

from roboirg.core.episode import ALL_COLORS, Goal, SlotValue
from roboirg.language.instruction import Instruction, hidden_slots

_NUMBERS = {
    1: frozenset(("1", "one", "ones", "once", "first", "single", "1st")),
    2: frozenset(("2", "two", "twos", "twice", "second", "double", "2nd", "both", "pair")),
    3: frozenset(("3", "three", "threes", "thrice", "third", "3rd")),
    4: frozenset(("4", "four", "fours", "fourth", "4th")),
    5: frozenset(("5", "five", "fives", "fifth", "5th")),
}
_COLOR_WORDS = frozenset(
    spelling for name in (*ALL_COLORS, "grey") for spelling in (name, f"{name}s")
)
_TIME_WORDS = frozenset(
    ("before", "after", "earlier", "later", "previous", "previously", "next", "following")
)
_POINTERS = ("first", "second", "third", "one", "each", "other")


def find_leaks(instruction: Instruction, goal: Goal) -> frozenset[str]:
    """Return the words and landmarks of an implicit command that give a hidden value away."""
    text = _without_pointers(instruction).lower().replace("before or after", "")
    words = frozenset(re.findall(r"[a-z0-9]+", text))
    hidden = hidden_slots(instruction, goal)
    found = [words & _spellings(goal[slot]) for slot in hidden]
    places = cast("list[str]", instruction.metadata["landmarks"])
    named = [place for place in places if place in instruction.command]
    return frozenset(named).union(*found)


def _spellings(value: SlotValue) -> frozenset[str]:
    if isinstance(value, tuple):
        several: tuple[str | int, ...] = value
        return frozenset().union(*(_spellings(one) for one in several))
    if isinstance(value, int):
        return _NUMBERS[value]
    # Any color: naming another one gives something away, too.
    return _COLOR_WORDS if value in ALL_COLORS else _TIME_WORDS


def _without_pointers(instruction: Instruction) -> str:
    """Return the command without *the first of them*, *the one I mentioned* and *once for each*.

    Their numbers say nothing about the goal's.
    """
    text = instruction.command
    last = len(instruction.utterances) - 1
    for mention in reversed(instruction.mentions):
        if mention.utterance == last and mention.expression in _POINTERS:
            text = text[: mention.start] + text[mention.end :]
    return text
