"""Score shortcuts on the instructions of a split: shares of hidden slots and of goals."""

from __future__ import annotations

import statistics
from collections.abc import Callable, Iterable, Mapping, Sequence
from fractions import Fraction
from typing import Literal, NamedTuple, get_args

from roboirg.core.episode import Episode, Goal
from roboirg.language.instruction import Instruction
from roboirg.language.instruction import hidden_slots as hidden_in
from roboirg.shortcuts.command_chance import blind_goals, right_share
from roboirg.shortcuts.goal_vocabulary import values_in
from roboirg.shortcuts.surface_rules import SURFACE_RULES
from roboirg.shortcuts.text_guess import goal_share, guess_goal, slot_share

CHANCE = "chance"

Told = tuple[Episode, Instruction]
"""An episode and one of its instructions."""
Grouping = Literal["pattern", "task"]
GROUPINGS: tuple[Grouping, ...] = get_args(Grouping)


class ShortcutScore(NamedTuple):
    """The score of one shortcut on one instruction.

    Attributes:
        slots: for each hidden slot the expected share of its values that are right, 0 to 1.
        goal: the probability that the whole goal is right.
    """

    slots: tuple[Fraction, ...]
    goal: Fraction


class ShortcutShares(NamedTuple):
    """Mean scores over instructions.

    Attributes:
        slots: over all hidden slots; None if nothing is hidden.
        goals: over all instructions.
    """

    slots: float | None
    goals: float


Scorer = Callable[[Told], ShortcutScore]


def hidden_slots(told: Told) -> tuple[str, ...]:
    """Return the slots that the command leaves out, in the order of the goal."""
    episode, instruction = told
    hidden = hidden_in(instruction, episode.goal)
    return tuple(slot for slot, _ in episode.goal.slots if slot in hidden)


def score_chance(told: Told) -> ShortcutScore:
    """Score a blind guess among the goals that command and scene leave; see `blind_goals`."""
    episode, instruction = told
    goals = blind_goals(instruction, episode)
    slots = tuple(
        sum((_overlap(goal, episode.goal, slot) for goal in goals), Fraction(0)) / len(goals)
        for slot in hidden_slots(told)
    )
    return ShortcutScore(slots, right_share(goals, episode))


def _overlap(guess: Goal, goal: Goal, slot: str) -> Fraction:
    wanted = values_in(goal[slot])
    right = sum(a == b for a, b in zip(values_in(guess[slot]), wanted, strict=False))
    return Fraction(right, len(wanted))


def score_rule(rule: str, told: Told) -> ShortcutScore:
    """Score a surface rule, which sees the text of the instruction only."""
    episode, instruction = told
    guess = guess_goal(rule, instruction.text, episode.task)
    slots = tuple(slot_share(guess, slot, episode.goal[slot]) for slot in hidden_slots(told))
    return ShortcutScore(slots, goal_share(guess, episode))


def rule_scorers() -> Mapping[str, Scorer]:
    """Return chance and all surface rules, by name."""

    def scorer(rule: str) -> Scorer:
        return lambda told: score_rule(rule, told)

    return {CHANCE: score_chance, **{rule: scorer(rule) for rule in SURFACE_RULES}}


def mean_shares(scores: Sequence[ShortcutScore]) -> ShortcutShares:
    """Return the mean over one or more instructions; every hidden slot weighs the same."""
    slots = [share for score in scores for share in score.slots]
    return ShortcutShares(
        slots=float(statistics.mean(slots)) if slots else None,
        goals=float(statistics.mean(score.goal for score in scores)),
    )


def group_told(
    told: Iterable[Told], by: Grouping | None = None
) -> dict[tuple[str, ...], list[Told]]:
    """Group instructions by setting, and within it by reasoning pattern or task if wanted."""
    groups: dict[tuple[str, ...], list[Told]] = {}
    for episode, instruction in told:
        key: tuple[str, ...] = (instruction.setting,)
        if by is not None:
            pattern = instruction.metadata["pattern"] or "–"
            key = (*key, str(pattern) if by == "pattern" else episode.task)
        groups.setdefault(key, []).append((episode, instruction))
    return groups
