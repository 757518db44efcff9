"""The chance level: the expected success of a policy that hears only the final command.

The forgetful listener chooses uniformly among the goals that fit the command, or among all goals if
none fits. Its expected success follows without playing, assuming flawless execution: the share of
these goals that have the stages of the right one. Nothing is estimated.
"""

from __future__ import annotations

import functools
from collections.abc import Iterable
from fractions import Fraction

from roboirg.core.instruction_options import InstructionOptions
from roboirg.episodes.splits import get_episode
from roboirg.evaluation.plan import instruct_job
from roboirg.language import interpret
from roboirg.records.record import Job
from roboirg.tasks import get_task


def chance_level(jobs: Iterable[Job]) -> Fraction | None:
    """Return the mean chance over the distinct instructions of some jobs; None without jobs.

    Policies and their seeds do not matter.

    Raises:
        UnknownNameError: a task does not exist.
        InvalidValueError: an episode does not exist, or has no such instruction.
    """
    instructions = dict.fromkeys((job.task, job.split, job.episode, job.options) for job in jobs)
    chances = [_chance(*each) for each in instructions]
    return sum(chances, Fraction(0)) / len(chances) if chances else None


@functools.lru_cache(maxsize=16_384)
def _chance(task_name: str, split: str, number: int, options: InstructionOptions) -> Fraction:
    job = Job(policy="", task=task_name, split=split, episode=number, **options._asdict())
    episode, task = get_episode(task_name, split, number), get_task(task_name)
    scene = episode.scene
    fitting = interpret(instruct_job(job).command, scene, task_name).goals
    choices = fitting or task.goals(scene)
    # Goals with the same stages are the same to the judge.
    wanted = task.stages(scene, episode.goal)
    right = sum(task.stages(scene, goal) == wanted for goal in choices)
    return Fraction(right, len(choices))
