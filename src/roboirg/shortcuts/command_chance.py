"""What an instruction leaves open: all of it, its command alone, and a blind guess.

All of it is asked of the declared meaning. Words without one, such as scrambled ones, leave no
goal.
"""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction

from roboirg.core.episode import Episode, Goal
from roboirg.language import meaning
from roboirg.language.instruction import Instruction
from roboirg.tasks import get_task


def understood_goals(instruction: Instruction, episode: Episode) -> tuple[Goal, ...]:
    """Return the goals of the scene that fit a whole instruction; none if it has no meaning."""
    if instruction.meaning is None:
        return ()
    return meaning.meant_goals(instruction.meaning, episode)


def goals_of_command(instruction: Instruction, episode: Episode) -> tuple[Goal, ...]:
    """Return the goals of the scene that fit the last utterance alone; none without a meaning."""
    if instruction.meaning is None:
        return ()
    return meaning.command_goals(instruction.meaning, episode)


def blind_goals(instruction: Instruction, episode: Episode) -> tuple[Goal, ...]:
    """Return the goals of the scene among which a blind guesser chooses.

    They are those that fit the command, the last utterance. Where the text before it names
    candidates, such as a color and its rival, only these count: to pick one of two takes no
    understanding of which one is meant. Without a declared meaning there are none.
    """
    if instruction.meaning is None:
        return ()
    return meaning.candidate_goals(instruction.meaning, episode)


def right_share(goals: Sequence[Goal], episode: Episode) -> Fraction | None:
    """Return the share of some goals of the scene that are right; None without goals."""
    if not goals:
        return None
    right = [goal for goal in goals if is_right(goal, episode)]
    return Fraction(len(right), len(goals))


def is_right(goal: Goal, episode: Episode) -> bool:
    """Return whether a goal of the scene has the stages of the right one.

    Goals with the same stages are the same to the judge.
    """
    task = get_task(episode.task)
    return goal == episode.goal or task.stages(episode.scene, goal) == episode.stages
