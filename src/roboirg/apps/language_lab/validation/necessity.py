"""Necessity: an implicit command alone gives the goal only if the scene leaves one candidate."""

from __future__ import annotations

from collections import Counter

from roboirg.core.episode import Episode, Goal
from roboirg.language.instruction import Instruction
from roboirg.language.settings import all_settings
from roboirg.tasks import get_task

_NUMBER_SLOTS = ("repeats", "counts")


def only_candidate(episode: Episode, instruction: Instruction) -> bool:
    """Return whether the scene leaves one goal with the numbers that the command states.

    It does if all cubes have the same color. In BinFill it also does if only one choice of colors
    has enough cubes, or if the goal wants all colors in equal numbers.
    """
    if not all_settings()[instruction.setting].hides_only_color(instruction):
        return False
    candidates = get_task(episode.task).goals(episode.scene)
    wanted = _numbers(episode.goal)
    return sum(_numbers(goal) == wanted for goal in candidates) == 1


def _numbers(goal: Goal) -> Counter[int]:
    found: Counter[int] = Counter()
    for slot, value in goal.slots:
        if slot in _NUMBER_SLOTS:
            found.update(goal.numbers(slot) if isinstance(value, tuple) else [goal.number(slot)])
    return found
