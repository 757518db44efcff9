"""Guess a whole goal from the words of an instruction.

A slot of a goal has one place or several: the colors of two containers are two places of a slot.
"""

from __future__ import annotations

import functools
from collections.abc import Iterable, Mapping, Sequence
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
    pointed_index,
    stated_values,
    thing_count,
)
from roboirg.shortcuts.surface_rules import SURFACE_RULES, Candidates, SlotWords, certain
from roboirg.tasks import get_task, goals_of

TextGuess = Mapping[str, tuple[Candidates, ...]]
"""Candidates for each place of each slot; within a place they are equally likely."""


@functools.lru_cache(maxsize=1024)
def guess_goal(rule: str, text: str, task: str) -> TextGuess:
    """Return the goal that a rule guesses from a prompt, by goal slot, without the scene.

    Each slot has one or several places, and each place its candidates, equally likely. The rule
    ``first-mention`` for *Red and blue are fine. Pick one of them twice.* -> ``{"color":
    (("red",),), "repeats": ((2,),)}``.

    Args:
        rule: name of one of `SURFACE_RULES`.
        text: the whole prompt.
        task: name of the task.
    """
    check_names("rule", [rule], SURFACE_RULES)
    vocabulary = goal_vocabulary(task)
    thing_total = thing_count(text, get_task(task).things.handled, vocabulary)
    guess: dict[str, tuple[Candidates, ...]] = {}
    for slot, slot_vocabulary in vocabulary.items():
        value_count = thing_total if slot_vocabulary.several else 1
        candidates = _candidates(rule, text, slot, slot_vocabulary, value_count)
        # Where a rule has nothing to go by, every value is as likely.
        candidates += [slot_vocabulary.values] * value_count
        guess[slot] = tuple(candidates[:value_count])
    return guess


def _candidates(
    rule: str, text: str, slot: str, vocabulary: SlotVocabulary, value_count: int
) -> list[Candidates]:
    """Return the possible values for each place of a goal slot.

    Values that the command states are certain; else the rule decides.

    Args:
        rule: its name.
        text: the whole prompt.
        slot: name of the goal slot.
        vocabulary: of the slot.
        value_count: number of values to find.
    """
    stated = stated_values(text, slot, vocabulary)
    if stated:
        return certain(stated)
    named = named_values(text, slot, vocabulary)
    words = SlotWords(
        slot=slot,
        vocabulary=vocabulary,
        named=tuple(mention.value for mention in named),
        command=command_words(text),
        value_count=value_count,
        pointed_index=pointed_index(text),
        ranks=command_ranks(text),
    )
    found = SURFACE_RULES[rule](words)
    return [candidates or vocabulary.values for candidates in found]


def slot_share(guess: TextGuess, slot: str, content: SlotValue, places: Sequence[int]) -> Fraction:
    """Return the expected share of a slot's values that a guess gets right.

    Args:
        guess: of the whole goal.
        slot: name of the slot.
        content: the right value or values of the slot.
        places: indices of the values that are scored.
    """
    values = values_in(content)
    guessed = guess[slot]
    total = Fraction(0)
    for place in places:
        if place < len(guessed):
            total += _share(guessed[place], values[place])
    return total / len(places)


def goal_share(guess: TextGuess, episode: Episode) -> Fraction:
    """Return the probability that a goal drawn from a guess is right.

    Several goals of the scene may be right, as they have the same stages. Their probabilities add,
    and so do those of the orders in which a goal can be said.
    """
    total = Fraction(0)
    for goal in goals_of(episode):
        probability = Fraction(0)
        for slots in orders(goal):
            probability += _probability(guess, slots)
        if probability and is_right(goal, episode):
            total += probability
    return total


def draw_goal(guess: TextGuess, goals: Iterable[Goal], rng: np.random.Generator) -> Goal | None:
    """Return a goal that is drawn at random from a guess, one of those that there are.

    None if none of them has the values that were drawn.

    Args:
        guess: candidates by slot.
        goals: of a scene, or all of a task.
        rng: draws one candidate for each place.
    """
    drawn: dict[str, tuple[Value, ...]] = {}
    for slot, places in guess.items():
        values = [candidates[int(rng.integers(len(candidates)))] for candidates in places]
        drawn[slot] = tuple(values)
    for goal in goals:
        for slots in orders(goal):
            goal_values = {slot: values_in(content) for slot, content in slots.items()}
            if goal_values == drawn:
                return goal
    return None


def _probability(guess: TextGuess, slots: Mapping[str, SlotValue]) -> Fraction:
    """Return the probability that a draw from a guess gives exactly these values.

    One of two colors and a certain number -> 1/2.
    """
    probability = Fraction(1)
    for slot, places in guess.items():
        values = values_in(slots[slot])
        if len(values) != len(places):
            return Fraction(0)
        for candidates, value in zip(places, values, strict=True):
            if value not in candidates:
                return Fraction(0)
            probability *= _share(candidates, value)
    return probability


def _share(candidates: Candidates, value: Value) -> Fraction:
    """Return the probability of a value if one of the candidates is drawn."""
    return Fraction(candidates.count(value), len(candidates))
