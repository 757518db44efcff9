"""Guess a whole goal from the words of an instruction, by a surface rule.

A slot of a goal has one position for each of its values: the colors of two containers are two
positions of the slot ``colors``.
"""

from __future__ import annotations

import functools
from collections.abc import Iterable, Mapping, Sequence
from fractions import Fraction

import numpy as np

from roboirg.core.episode import Episode, Goal, SlotValue, values_in
from roboirg.core.errors import check_names
from roboirg.language.goal_fields import in_every_order
from roboirg.shortcuts.command_chance import is_right
from roboirg.shortcuts.goal_vocabulary import (
    SlotVocabulary,
    Value,
    goal_vocabulary,
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
"""A guess of a goal: by slot, the candidates for each position, of which each is as likely.

``{"color": (("red", "blue"),), "repeats": ((2,),)}`` is red or blue, twice.
"""


@functools.lru_cache(maxsize=1024)
def guess_goal(rule: str, text: str, task: str) -> TextGuess:
    """Return the goal that a surface rule guesses from an instruction, without the scene.

    The rule ``first-mention`` for *Red and blue are fine. Pick one of them twice.* ->
    ``{"color": (("red",),), "repeats": ((2,),)}``: one position in each slot, each with one
    candidate. Where a position has several candidates, they are equally likely.

    Args:
        rule: name of one of `SURFACE_RULES`.
        text: the whole instruction.
        task: name of the task.
    """
    check_names("rule", [rule], SURFACE_RULES)
    vocabulary = goal_vocabulary(task)
    thing_total = thing_count(text, get_task(task).things.handled, vocabulary)
    guess: dict[str, tuple[Candidates, ...]] = {}
    for slot, slot_vocabulary in vocabulary.items():
        value_count = min(thing_total, slot_vocabulary.longest)
        candidates = _candidates(rule, text, slot, slot_vocabulary, value_count)
        # Where a rule has nothing to go by, every value is as likely.
        candidates += [slot_vocabulary.values] * value_count
        guess[slot] = tuple(candidates[:value_count])
    return guess


def _candidates(
    rule: str, text: str, slot: str, vocabulary: SlotVocabulary, value_count: int
) -> list[Candidates]:
    """Return the candidates for the positions of a goal slot, as many as are found.

    Values that the command states are certain; without any, the rule decides.

    Args:
        rule: its name.
        text: the whole instruction.
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


def slot_share(
    guess: TextGuess, slot: str, content: SlotValue, positions: Sequence[int]
) -> Fraction:
    """Return the expected share of a slot's values that a guess gets right, 0 to 1.

    Where the candidates are red or blue, and red is right, it is 1/2.

    Args:
        guess: of the whole goal.
        slot: name of the slot.
        content: the right value or values of the slot.
        positions: indices of the values that are scored.
    """
    values = values_in(content)
    guessed = guess[slot]
    total = Fraction(0)
    for position in positions:
        if position < len(guessed):
            total += _probability_of_value(guessed[position], values[position])
    return total / len(positions)


def goal_share(guess: TextGuess, episode: Episode) -> Fraction:
    """Return the probability that a goal drawn from a guess is right, 0 to 1.

    Several goals of the scene may be right, as they have the same stages. Their probabilities add,
    and so do those of the orders of values in which a goal can be said.
    """
    total = Fraction(0)
    for goal in goals_of(episode):
        probability = Fraction(0)
        for ordered_goal in in_every_order(goal):
            probability += _probability(guess, ordered_goal)
        if probability and is_right(goal, episode):
            total += probability
    return total


def draw_goal(guess: TextGuess, goals: Iterable[Goal], rng: np.random.Generator) -> Goal | None:
    """Return a goal that is drawn at random from a guess, one of those that there are.

    There is one draw for each position, in the order of the guess. None if no goal has the values
    that were drawn.

    Args:
        guess: candidates by slot.
        goals: of a scene, or all of a task.
        rng: draws one candidate for each position.
    """
    drawn: dict[str, tuple[Value, ...]] = {}
    for slot, positions in guess.items():
        values = [candidates[int(rng.integers(len(candidates)))] for candidates in positions]
        drawn[slot] = tuple(values)
    for goal in goals:
        if _can_be_said_as(goal, drawn):
            return goal
    return None


def _can_be_said_as(goal: Goal, values: Mapping[str, tuple[Value, ...]]) -> bool:
    """Return whether a goal has some values by slot, in an order in which it can be said."""
    for ordered_goal in in_every_order(goal):
        if values == {slot: values_in(content) for slot, content in ordered_goal.slots}:
            return True
    return False


def _probability(guess: TextGuess, goal: Goal) -> Fraction:
    """Return the probability that a draw from a guess gives exactly the values of a goal.

    Red or blue, and certainly twice: the goal *red, twice* -> 1/2.
    """
    probability = Fraction(1)
    for slot, positions in guess.items():
        values = values_in(goal[slot])
        if len(values) != len(positions):
            return Fraction(0)
        for candidates, value in zip(positions, values, strict=True):
            probability *= _probability_of_value(candidates, value)
    return probability


def _probability_of_value(candidates: Candidates, value: Value) -> Fraction:
    """Return the probability of a value if one of the candidates is drawn; 0 if it is none."""
    return Fraction(candidates.count(value), len(candidates))
