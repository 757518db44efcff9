"""Guess a whole goal from the words of an instruction."""

from __future__ import annotations

import functools
import itertools
import math
from collections.abc import Mapping
from fractions import Fraction

import numpy as np

from roboirg.core.episode import Episode, Goal, SlotValue, values_in
from roboirg.core.errors import check_names
from roboirg.shortcuts.command_chance import is_right
from roboirg.shortcuts.goal_vocabulary import (
    SlotVocabulary,
    Value,
    goal_vocabulary,
    orders,
)
from roboirg.shortcuts.named_values import (
    command_ranks,
    command_words,
    named_values,
    part_count,
    pointed_value,
)
from roboirg.shortcuts.surface_rules import SURFACE_RULES, Candidates, SlotWords
from roboirg.tasks import get_task, goals_of

TextGuess = Mapping[str, tuple[Candidates, ...]]
"""Candidates for each place of each slot; within a place they are equally likely."""


@functools.lru_cache(maxsize=1024)
def guess_goal(rule: str, text: str, task: str) -> TextGuess:
    """Return what one of `SURFACE_RULES` makes of a whole prompt of a task."""
    check_names("rule", [rule], SURFACE_RULES)
    vocabulary = goal_vocabulary(task)
    parts = part_count(text, get_task(task).commands.thing, vocabulary)
    return {
        slot: _candidates(rule, text, slot, one, parts if one.several else 1)
        for slot, one in vocabulary.items()
    }


def _candidates(
    rule: str, text: str, slot: str, vocabulary: SlotVocabulary, parts: int
) -> tuple[Candidates, ...]:
    named = named_values(text, slot, vocabulary)
    found: list[Candidates] = [(one.value,) for one in named if one.stated]
    if not found:
        values = tuple(one.value for one in named)
        command, ranks = command_words(text), command_ranks(text)
        words = SlotWords(slot, vocabulary, values, command, parts, pointed_value(text), ranks)
        found = SURFACE_RULES[rule](words)
    # Where a rule has nothing to go by, every value is as likely.
    padded = itertools.chain(found, itertools.repeat(()))
    return tuple(one or vocabulary.values for one in itertools.islice(padded, parts))


def slot_share(guess: TextGuess, slot: str, content: SlotValue) -> Fraction:
    """Return the expected share of a slot's values that a guess gets right."""
    values = values_in(content)
    places = zip(guess[slot], values, strict=False)
    return sum((_share(place, value) for place, value in places), Fraction(0)) / len(values)


def goal_share(guess: TextGuess, episode: Episode) -> Fraction:
    """Return the probability that a guess is the right goal."""
    total = Fraction(0)
    for goal in goals_of(episode):
        probability = sum((_probability(guess, slots) for slots in orders(goal)), Fraction(0))
        if probability and is_right(goal, episode):
            total += probability
    return total


def draw_goal(guess: TextGuess, episode: Episode, rng: np.random.Generator) -> Goal | None:
    """Draw a goal from a guess; None if the scene does not have it."""
    drawn = {
        slot: tuple(candidates[int(rng.integers(len(candidates)))] for candidates in places)
        for slot, places in guess.items()
    }
    for goal in goals_of(episode):
        for slots in orders(goal):
            if {slot: values_in(content) for slot, content in slots.items()} == drawn:
                return goal
    return None


def _probability(guess: TextGuess, slots: Mapping[str, SlotValue]) -> Fraction:
    """Return the probability that a guess is exactly these values."""
    shares: list[Fraction] = []
    for slot, places in guess.items():
        values = values_in(slots[slot])
        if len(values) != len(places):
            return Fraction(0)
        if not all(value in place for place, value in zip(places, values, strict=True)):
            return Fraction(0)
        shares += [_share(place, value) for place, value in zip(places, values, strict=True)]
    return math.prod(shares, start=Fraction(1))


def _share(candidates: Candidates, value: Value) -> Fraction:
    return Fraction(candidates.count(value), len(candidates))
