"""Multiple choice: the goal that is meant among goals that the command alone leaves open."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence

import numpy as np

from roboirg.core.episode import Episode, Goal
from roboirg.language.instruction import Instruction
from roboirg.shortcuts.command_chance import blind_goals, is_right
from roboirg.tasks import goals_of

MOST = 4
_BLOCK = 12
"""Neighboring episodes among which the right choice has every place equally often; 12 can be
divided by every number of choices."""


def draw_choices(
    episode: Episode, instruction: Instruction, identity: str
) -> tuple[tuple[Goal, ...], int]:
    """Return the choices, in an order that does not depend on the goal.

    The others are goals that fit the command alone: who ignores its context can only guess. Where
    the command leaves none, they are goals with as many values, or any goals of the scene.

    Args:
        episode: the episode.
        instruction: what is said.
        identity: of the item; equal identities have equal choices.

    Returns:
        Two to four goals of the scene, or one if it has no other; and the index of that which is
        meant.
    """
    wrong = _wrong_goals(episode, instruction)
    drawn = _generator("goals", identity).permutation(len(wrong))[: MOST - 1]
    others = [wrong[index] for index in drawn]
    block, place = divmod(episode.index, _BLOCK)
    group = (episode.task, episode.split, repr(instruction.setting), instruction.form, str(block))
    right = int(_generator("place", *group).permutation(_BLOCK)[place]) % (len(others) + 1)
    return (*others[:right], episode.goal, *others[right:]), right


def _wrong_goals(episode: Episode, instruction: Instruction) -> Sequence[Goal]:
    every = [goal for goal in goals_of(episode) if not is_right(goal, episode)]
    blind = set(blind_goals(instruction, episode))
    alike = [goal for goal in every if _shape(goal) == _shape(episode.goal)]
    return [goal for goal in every if goal in blind] or alike or every


def _shape(goal: Goal) -> tuple[int, ...]:
    return tuple(len(value) if isinstance(value, tuple) else 1 for _, value in goal.slots)


def _generator(*parts: str) -> np.random.Generator:
    digest = hashlib.sha256("\n".join(parts).encode()).digest()
    return np.random.default_rng(int.from_bytes(digest[:16]))
