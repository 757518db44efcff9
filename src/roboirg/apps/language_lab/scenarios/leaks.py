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
_ONE_THING = re.compile(r"\b(?:that|the) one\b(?! time)|\bboth targets\b")
"""Of one thing, or of the two that are there, not the number."""
_COUNTING_REFERENCES = ("first", "second", "third", "one", "each", "other")


def find_leaks(instruction: Instruction, goal: Goal) -> frozenset[str]:
    """Return the words of a command that name a goal value which only its context may give.

    If the introduction is to say the color, the command *Lift the red cube* leaks ``{"red"}``. A
    landmark of the goal, such as *next to the bin*, leaks as a whole if the command says it.
    """
    text = _ONE_THING.sub("", _without_references(instruction).lower())
    words = set(re.findall(r"[a-z0-9]+", text))
    leaked = set()
    for slot in hidden_slots(instruction, goal):
        leaked |= words & _spellings(goal[slot])
    for landmark in cast("list[str]", instruction.metadata["landmarks"]):
        if landmark in instruction.command:
            leaked.add(landmark)
    return frozenset(leaked)


def _spellings(value: SlotValue) -> frozenset[str]:
    """Return all words that could give a goal value away.

    For 2 *two*, *twice*, *both* …, for a color the names of all colors, for a moment such as
    ``before`` all words for time, and for several values the words of each.
    """
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


def _without_references(instruction: Instruction) -> str:
    """Return the command without words that point back with a number, such as *the first of them*.

    Their numbers are no values of the goal, so they leak nothing.
    """
    text = instruction.command
    last = len(instruction.utterances) - 1
    # From the end, so that the positions of earlier mentions stay right.
    for mention in reversed(instruction.mentions):
        if mention.utterance == last and mention.expression in _COUNTING_REFERENCES:
            text = text[: mention.start] + text[mention.end :]
    return text
