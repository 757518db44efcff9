"""The chance level of one instruction: what its final command leaves to a blind guess."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from fractions import Fraction
from typing import cast

from roboirg.core.episode import Episode, Goal, SlotValue, values_in
from roboirg.language.instruction import Instruction
from roboirg.reader import interpret
from roboirg.tasks import get_task, goals_of


def fitting_goals(text: str, episode: Episode) -> tuple[Goal, ...]:
    """Return the goals that fit a text in an episode's scene; all possible goals if none does."""
    return interpret(text, episode.scene, episode.task).goals or goals_of(episode)


def blind_goals(instruction: Instruction, episode: Episode) -> tuple[Goal, ...]:
    """Return the goals among which a guess is blind: those that fit the command alone.

    Where the context names the candidates, as with a rival, it is a guess among them: to pick one
    of two takes no understanding of which one is meant.
    """
    fitting = fitting_goals(instruction.command, episode)
    candidates = cast("Mapping[str, list[str | int]]", instruction.metadata["candidates"])
    if not candidates:
        return fitting
    shapes = [_shape(goal, candidates) for goal in fitting]
    return tuple(
        goal
        for goal in goals_of(episode)
        if _shape(goal, candidates) in shapes
        and all(set(values_in(goal[slot])) <= set(values) for slot, values in candidates.items())
    )


def _shape(goal: Goal, candidates: Collection[str]) -> list[tuple[str, SlotValue]]:
    """Return a goal with the number of values in place of those of the candidates."""
    return [
        (slot, len(set(values_in(value))) if slot in candidates else value)
        for slot, value in goal.slots
    ]


def right_share(goals: Sequence[Goal], episode: Episode) -> Fraction:
    """Return the share of one or more goals of the scene that are right."""
    return Fraction(sum(is_right(goal, episode) for goal in goals), len(goals))


def is_right(goal: Goal, episode: Episode) -> bool:
    """Return whether a goal of the scene has the stages of the right one.

    Goals with the same stages are the same to the judge.
    """
    task = get_task(episode.task)
    return goal == episode.goal or task.stages(episode.scene, goal) == episode.stages
