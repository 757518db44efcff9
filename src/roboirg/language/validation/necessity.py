"""Necessity: the one case in which a command alone may tell the goal."""

from __future__ import annotations

from collections import Counter

from roboirg.core.episode import Episode, Goal
from roboirg.language.instruction import Instruction
from roboirg.language.settings import all_settings
from roboirg.tasks import get_task

_NUMBER_SLOTS = ("repeats", "counts")


def only_candidate(episode: Episode, instruction: Instruction) -> bool:
    """Whether the scene leaves a single goal with the numbers that the command states.

    It does where all cubes have one color, and in BinFill also where only one choice of colors
    has so many cubes each, or where all colors are wanted in equal numbers.
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
