"""No leak: the command of a scenario contains no hidden value, in any spelling."""

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
_COLORS = (*ALL_COLORS, "grey")
_COLOR_WORDS = frozenset(_COLORS) | frozenset(f"{name}s" for name in _COLORS)
_TIME_WORDS = frozenset(
    ("before", "after", "earlier", "later", "previous", "previously", "next", "following")
)
_THINGS = re.compile(r"\b(?:that|the) one\b(?! time)|\bboth targets\b")
"""Of one thing, or of the two that are there, not the number."""
_POINTERS = ("first", "second", "third", "one", "each", "other")


def find_leaks(instruction: Instruction, goal: Goal) -> frozenset[str]:
    """Return the words and landmarks of an implicit command that give a hidden value away.

    With the color red hidden, *Lift the red cube* leaks ``red``.
    """
    text = _THINGS.sub("", _without_pointers(instruction).lower())
    words = set(re.findall(r"[a-z0-9]+", text))
    leaked: set[str] = set()
    for slot in hidden_slots(instruction, goal):
        leaked |= words & _spellings(goal[slot])
    for place in cast("list[str]", instruction.metadata["landmarks"]):
        if place in instruction.command:
            leaked.add(place)
    return frozenset(leaked)


def _spellings(value: SlotValue) -> frozenset[str]:
    """Return all words that give a value away: of ``2`` *two*, *twice*, *both* and so on."""
    if isinstance(value, tuple):
        found: set[str] = set()
        for part in value:
            found |= _spellings(part)
        return frozenset(found)
    if isinstance(value, int):
        return _NUMBERS[value]
    if value in ALL_COLORS:
        return _COLOR_WORDS  # naming another color gives something away, too
    return _TIME_WORDS


def _without_pointers(instruction: Instruction) -> str:
    """Return the command without *the first of them*, *the one I mentioned* and *once for each*.

    Their numbers say nothing about the goal's.
    """
    text = instruction.command
    last = len(instruction.utterances) - 1
    for mention in reversed(instruction.mentions):  # the last first, so that places stay
        if mention.utterance == last and mention.expression in _POINTERS:
            text = text[: mention.start] + text[mention.end :]
    return text
