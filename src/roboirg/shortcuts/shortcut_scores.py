"""Score shortcuts on the instructions of a split: shares of hidden slots and of goals."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from fractions import Fraction
from functools import partial
from typing import NamedTuple, cast

from roboirg.core.episode import Goal, values_in
from roboirg.core.errors import InvalidValueError
from roboirg.language.instruction import hidden_slots as hidden_in
from roboirg.shortcuts.command_chance import blind_goals, right_share
from roboirg.shortcuts.goal_learner import Told
from roboirg.shortcuts.surface_rules import SURFACE_RULES
from roboirg.shortcuts.text_guess import TextGuess, goal_share, guess_goal, slot_share

CHANCE = "chance"


class ShortcutScore(NamedTuple):
    """The score of one shortcut on one instruction.

    Attributes:
        slots: for each slot that counts the expected share of its values that are right, 0 to 1.
        goal: the probability that the whole goal is right.
    """

    slots: Mapping[str, Fraction]
    goal: Fraction


Scorer = Callable[[Told], ShortcutScore]


def hidden_slots(told: Told) -> tuple[str, ...]:
    """Return the slots that the command leaves out, in the order of the goal."""
    episode, instruction = told
    hidden = hidden_in(instruction, episode.goal)
    return tuple(slot for slot, _ in episode.goal.slots if slot in hidden)


def counted_slots(told: Told) -> tuple[str, ...]:
    """Return the slots that count: those that the instruction names as touched, or all hidden."""
    touched = cast("list[str]", told[1].metadata.get("touched", []))
    slots = tuple(slot for slot, _ in told[0].goal.slots if slot in touched)
    return slots or hidden_slots(told)


def score_chance(told: Told) -> ShortcutScore:
    """Score a blind guess among the goals that command and scene leave; see `blind_goals`."""
    episode, instruction = told
    goals = blind_goals(instruction, episode)
    share = right_share(goals, episode)
    if share is None:
        raise InvalidValueError(f"{episode.key}: no meaning is known of {instruction.text!r}.")
    slots: dict[str, Fraction] = {}
    for slot in counted_slots(told):
        overlaps = [_overlap(goal, episode.goal, slot) for goal in goals]
        slots[slot] = sum(overlaps, Fraction(0)) / len(goals)
    return ShortcutScore(slots, share)


def _overlap(guess: Goal, goal: Goal, slot: str) -> Fraction:
    wanted = values_in(goal[slot])
    right = sum(a == b for a, b in zip(values_in(guess[slot]), wanted, strict=False))
    return Fraction(right, len(wanted))


def score_guess(guess: TextGuess, told: Told) -> ShortcutScore:
    """Score a guess of the whole goal."""
    goal = told[0].goal
    slots = {slot: slot_share(guess, slot, goal[slot]) for slot in counted_slots(told)}
    return ShortcutScore(slots, goal_share(guess, told[0]))


def score_rule(rule: str, told: Told) -> ShortcutScore:
    """Score a surface rule, which sees the text of the instruction only."""
    episode, instruction = told
    return score_guess(guess_goal(rule, instruction.text, episode.task), told)


def rule_scorers() -> Mapping[str, Scorer]:
    """Return chance and all surface rules, by name."""
    return {CHANCE: score_chance} | {rule: partial(score_rule, rule) for rule in SURFACE_RULES}
