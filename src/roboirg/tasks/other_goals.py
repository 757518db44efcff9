"""Another goal of the same scene, for the control arm `other-goal`."""

from __future__ import annotations

import zlib
from collections.abc import Sequence

import numpy as np

from roboirg.core.arms import OTHER_GOAL
from roboirg.core.episode import PICKS, Episode, Goal, Stage
from roboirg.tasks import get_task
from roboirg.util.random_draws import draw


def other_goals(episode: Episode) -> tuple[Goal, ...]:
    """Return the goals of the scene that are clearly wrong for the episode, but as much work.

    They take as many picks as the episode's goal, and none of them is reached on the way to it, or
    it on the way to them: to *red, then blue*, *green, then blue* is another goal, and *red* is
    none.
    """
    task = get_task(episode.task)
    others = []
    for goal in task.goals(episode.scene):
        stages = task.stages(episode.scene, goal)
        overlaps = begins_with(stages, episode.stages) or begins_with(episode.stages, stages)
        if not overlaps and _count_picks(stages) == _count_picks(episode.stages):
            others.append(goal)
    return tuple(others)


def draw_other_goal(episode: Episode) -> Goal | None:
    """Return one of `other_goals`, all equally likely; None if there is none.

    The draw depends on the episode's task and seed alone, not on any words: the same episode always
    gets the same other goal.
    """
    goals = other_goals(episode)
    if not goals:
        return None
    task_number = zlib.crc32(f"{OTHER_GOAL}|{episode.task}".encode())
    rng = np.random.default_rng([episode.seed, task_number])
    return draw(rng, goals)


def begins_with(stages: Sequence[Stage], first: Sequence[Stage]) -> bool:
    """Return whether `stages` begin with `first`, as far as the judge can tell.

    Stages that differ only in how the oracle moves, or in their subgoals' words, count as equal.
    """
    return _judged(stages[: len(first)]) == _judged(first)


def _judged(stages: Sequence[Stage]) -> list[tuple[object, ...]]:
    """Return, for each stage, the fields that the judge reads.

    The fields for the oracle's movement and for the subgoal's words are left out.
    """
    return [(stage.expects, stage.forbids, stage.lasting, stage.timer) for stage in stages]


def _count_picks(stages: Sequence[Stage]) -> int:
    """Return how many of the stages pick up a cube, tape or container."""
    return sum(stage.primitive.kind in PICKS for stage in stages)
