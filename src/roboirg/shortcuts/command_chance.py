"""Which goals of a scene fit an instruction: all of it, or its command (last utterance) alone.

An instruction declares its meaning (`roboirg.language.meaning`), of which these functions ask. One
without a meaning, such as scrambled words, fits no goal.
"""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction

from roboirg.core.episode import Episode, Goal
from roboirg.language import meaning
from roboirg.language.instruction import Instruction
from roboirg.tasks import get_task


def understood_goals(instruction: Instruction, episode: Episode) -> tuple[Goal, ...]:
    """Return the goals of the scene that fit a whole instruction: one if it leaves nothing open.

    Empty if the instruction has no meaning.
    """
    if instruction.meaning is None:
        return ()
    return meaning.meant_goals(instruction.meaning, episode)


def goals_of_command(instruction: Instruction, episode: Episode) -> tuple[Goal, ...]:
    """Return the goals of the scene that fit the last utterance alone.

    *The red one is Bob's. Lift it twice.* -> the goals with two repetitions, of every color. Empty
    if the instruction has no meaning.
    """
    if instruction.meaning is None:
        return ()
    return meaning.command_goals(instruction.meaning, episode)


def blind_goals(instruction: Instruction, episode: Episode) -> tuple[Goal, ...]:
    """Return the goals of the scene among which a guesser chooses that understands the command.

    They are those that fit the command, the last utterance. Where the text before it names
    candidates, *the red or the blue one*, only these count: to pick one of two takes no
    understanding of which one is meant. Empty if the instruction has no meaning.
    """
    if instruction.meaning is None:
        return ()
    return meaning.candidate_goals(instruction.meaning, episode)


def right_share(goals: Sequence[Goal], episode: Episode) -> Fraction | None:
    """Return the share of some goals of the scene that are right: 1/3 for one of three.

    That is the chance of a guess among them. None without goals.
    """
    if not goals:
        return None
    right = [goal for goal in goals if is_right(goal, episode)]
    return Fraction(len(right), len(goals))


def is_right(goal: Goal, episode: Episode) -> bool:
    """Return whether a goal of the scene counts as the episode's goal.

    So does every goal with the same stages, as the judge sees no difference.
    """
    task = get_task(episode.task)
    return goal == episode.goal or task.stages(episode.scene, goal) == episode.stages
