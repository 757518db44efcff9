"""Multiple choice: the goal that is meant among goals that the command alone leaves open."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from roboirg.core.episode import Episode, Goal
from roboirg.language.instruction import Instruction
from roboirg.shortcuts.command_chance import blind_goals, is_right
from roboirg.tasks import goals_of

MOST = 4
_BLOCK = 12
"""Neighboring episodes among which the right choice has every place equally often; 12 can be
divided by every number of choices."""


class GoalChoices(NamedTuple):
    """The choices of an item.

    Attributes:
        goals: two to four of the scene, or one if it has no other.
        right: index of that which is meant.
    """

    goals: tuple[Goal, ...]
    right: int


def draw_choices(episode: Episode, instruction: Instruction, identity: str) -> GoalChoices:
    """Return the choices of a multiple-choice question: the goal that is meant, and wrong ones.

    Wrong ones fit the command without its context, if there are any such goals, so a model that
    ignores the context can only guess. The place of the right one does not depend on the goal.

    Args:
        episode: whose goal is meant.
        instruction: what is said.
        identity: id of the item; equal ids have equal choices.
    """
    wrong = _wrong_goals(episode, instruction)
    drawn = _generator("goals", identity).permutation(len(wrong))[: MOST - 1]
    goals = [wrong[index] for index in drawn]
    right = _place_of_right(episode, instruction, len(goals) + 1)
    goals.insert(right, episode.goal)
    return GoalChoices(tuple(goals), right)


def _place_of_right(episode: Episode, instruction: Instruction, count: int) -> int:
    """Return the place, from 0, of the goal that is meant among `count` choices.

    Among each `_BLOCK` neighboring episodes every place is used equally often, so that always
    choosing the same letter is right no more often than chance. The goal has no influence.
    """
    block, place = divmod(episode.index, _BLOCK)
    setting = repr(instruction.setting)
    rng = _generator("place", episode.task, episode.split, setting, instruction.form, str(block))
    return int(rng.permutation(_BLOCK)[place]) % count


def _wrong_goals(episode: Episode, instruction: Instruction) -> Sequence[Goal]:
    """Return the wrong goals of the scene that are hardest to tell from the right one.

    The first of these groups that is not empty: goals that fit the command without its context;
    goals with as many values; all.
    """
    wrong = [goal for goal in goals_of(episode) if not is_right(goal, episode)]
    fit_command = set(blind_goals(instruction, episode))
    fitting = [goal for goal in wrong if goal in fit_command]
    same_shape = [goal for goal in wrong if _shape(goal) == _shape(episode.goal)]
    return fitting or same_shape or wrong


def _shape(goal: Goal) -> list[int]:
    """Return how many values each slot of a goal has: red and blue, then a number -> ``[2, 1]``."""
    counts = []
    for _, value in goal.slots:
        counts.append(len(value) if isinstance(value, tuple) else 1)
    return counts


def _generator(*parts: str) -> np.random.Generator:
    """Return a random generator whose numbers depend on the texts alone, on every machine."""
    digest = hashlib.sha256("\n".join(parts).encode()).digest()
    return np.random.default_rng(int.from_bytes(digest[:16]))
