"""The chance level of one instruction: what its final command alone leaves to a guess."""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction

from roboirg.core.episode import Episode, Goal
from roboirg.language.interpreter import interpret
from roboirg.tasks import get_task


def fitting_goals(text: str, episode: Episode) -> tuple[Goal, ...]:
    """Return the goals that fit a text in an episode's scene; all possible goals if none does."""
    task = get_task(episode.task)
    return interpret(text, episode.scene, task.name).goals or task.goals(episode.scene)


def right_share(goals: Sequence[Goal], episode: Episode) -> Fraction:
    """Return the share of one or more goals of the scene that are right."""
    return Fraction(sum(is_right(goal, episode) for goal in goals), len(goals))


def is_right(goal: Goal, episode: Episode) -> bool:
    """Return whether a goal of the scene has the stages of the right one.

    Goals with the same stages are the same to the judge.
    """
    task = get_task(episode.task)
    return goal == episode.goal or task.stages(episode.scene, goal) == episode.stages
