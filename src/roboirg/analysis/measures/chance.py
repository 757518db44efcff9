"""Expected success of the policies that do not understand: the chance level, and shortcuts.

The forgetful listener hears only the final command and chooses uniformly among the goals that fit
it. Its expected success, ``command``, follows without playing, assuming flawless execution: the
share of these goals that have the stages of the right one. The chance level is that of a guess
among the values that the context names, such as a value and its rival, or else the same. Neither is
known for words without a meaning. A shortcut listener draws its goal by a surface rule; its
expected success is the probability that this goal is right. Nothing of this is estimated. Learned
floors have the level that was measured for the task and setting, on the test split or random
scenes, in the version of the language that was played.
"""

from __future__ import annotations

import functools
from collections.abc import Iterable
from fractions import Fraction

from roboirg.analysis.measures.measured_floors import (
    LEARNED,
    RANDOM,
    TEST,
    FloorKey,
    measured_floors,
)
from roboirg.analysis.results.option_labels import is_usual
from roboirg.records.record import Job
from roboirg.runs.job_instruction import instruct_job
from roboirg.shortcuts.command_chance import blind_goals, goals_of_command, right_share
from roboirg.shortcuts.surface_rules import SURFACE_RULES
from roboirg.shortcuts.text_guess import goal_share, guess_goal
from roboirg.tasks.splits.splits import get_episode

CHANCE = "chance"
COMMAND = "command"
FLOORS = (CHANCE, COMMAND, *SURFACE_RULES, *LEARNED)
"""A blind guess, the forgetful listener, the shortcut listeners by their rules, and learners."""


def floor_level(floor: str, jobs: Iterable[Job], language: str = "") -> Fraction | None:
    """Return the expected success, 0 to 1, of a listener that does not understand instructions.

    It is the mean over the distinct instructions of some jobs; policies and their seeds do not
    matter. None without jobs, or if no level is known.

    Args:
        floor: which listener, one of `FLOORS`: ``chance`` guesses among the possible goals.
        jobs: episodes to play.
        language: version of the language in which they were played, of which learned floors are.
    """
    instructions = dict.fromkeys(map(_without_policy, jobs))  # each once, in their order
    levels = []
    for instruction in instructions:
        level = _level(floor, language, instruction)
        if level is not None:
            levels.append(level)
    if not levels:
        return None
    return sum(levels, Fraction(0)) / len(levels)


def _without_policy(job: Job) -> Job:
    """Return only what of a job decides its instruction."""
    return Job(policy="", task=job.task, split=job.split, episode=job.episode, options=job.column)


@functools.lru_cache(maxsize=65_536)
def _level(floor: str, language: str, job: Job) -> Fraction | None:
    """Return the expected success, 0 to 1, of a listener that does not understand one instruction.

    Args:
        floor: which listener: a learner whose success was measured, a guess among all goals
            (``chance``) or among those that fit the command (``command``), or a rule for words.
        language: version of the language, of which learned floors were measured.
        job: the episode and the options of its instruction.

    Returns:
        None if it is not known.
    """
    if floor in LEARNED:
        return _learned_level(floor, language, job)
    episode = get_episode(job.task, job.split, job.episode)
    instruction = instruct_job(job)
    if floor == CHANCE:
        return right_share(blind_goals(instruction, episode), episode)
    if floor == COMMAND:
        return right_share(goals_of_command(instruction, episode), episode)
    return goal_share(guess_goal(floor, instruction.text, job.task), episode)


def _learned_level(floor: str, language: str, job: Job) -> Fraction | None:
    """Return the success, 0 to 1, that was measured of a learner that sees words or scenes alone.

    It is that of the job's task and setting, on the test split or else on random scenes. None for a
    language version that was not measured, and for options other than the usual ones.
    """
    floors = measured_floors(language)
    if floors is None or not is_usual(job.options):
        return None
    split = TEST if job.split == TEST else RANDOM
    row = floors.get(FloorKey(split, job.setting, job.task))
    if row is None:
        return None
    return Fraction(str(row.shares[floor].goals))
