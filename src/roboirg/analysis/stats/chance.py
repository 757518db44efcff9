"""The chance level: what somebody reaches who hears only the final command.

The forgetful listener chooses uniformly among the goals that fit the command, or among all goals
where none does. So its expected success is known without playing: one by the number of goals it
chooses from, given hands that never slip. Nothing here is estimated.
"""

from __future__ import annotations

import functools
from collections.abc import Iterable
from fractions import Fraction

from roboirg.episodes.splits import get_episode
from roboirg.evaluation.plan import instruct_job
from roboirg.language import interpret
from roboirg.records.record import Job
from roboirg.tasks import get_task


def chance_of(job: Job) -> Fraction:
    """The share of the forgetful listener's choices that do what the episode asks for.

    Args:
        job: an episode and how it is told; who plays it, and how often, does not matter.

    Raises:
        UnknownNameError: there is no such task.
        InvalidValueError: there is no such episode, or it cannot be told so.
    """
    # Whatever is not about words keeps the default, so that the same words are looked up once.
    return _chance(
        Job(
            policy="",
            **{name: getattr(job, name) for name in _WORDS},
        )
    )


def chance_level(jobs: Iterable[Job]) -> Fraction | None:
    """The mean chance over the different tellings among some jobs; None for none."""
    tellings = {tuple(getattr(job, name) for name in _WORDS): job for job in jobs}
    chances = [chance_of(job) for job in tellings.values()]
    return sum(chances, Fraction(0)) / len(chances) if chances else None


_WORDS = (
    "task",
    "split",
    "episode",
    "setting",
    "form",
    "stages",
    "distractor",
    "distractors",
    "frame",
)
"""The fields of a job on which the words depend."""


@functools.lru_cache(maxsize=16_384)
def _chance(job: Job) -> Fraction:
    episode, task = get_episode(job.task, job.split, job.episode), get_task(job.task)
    scene = episode.scene
    fitting = interpret(instruct_job(job).command, scene, job.task).goals
    choices = fitting or task.goals(scene)
    # Goals that come down to the same stages are one to the judge.
    wanted = task.stages(scene, episode.goal)
    right = sum(task.stages(scene, goal) == wanted for goal in choices)
    return Fraction(right, len(choices))
