"""What an instruction leaves open: all of it, its command alone, and a blind guess.

Language 4 declares its meaning. The words of language 3 are read by the interpreter.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from fractions import Fraction
from typing import cast

from roboirg.core.episode import Episode, Goal, SlotValue, values_in
from roboirg.core.instruction_options import DEFAULT_LANGUAGE
from roboirg.language import meaning
from roboirg.language.instruction import Instruction
from roboirg.language.templates import LANGUAGE_VERSIONS
from roboirg.reader import interpret
from roboirg.tasks import get_task, goals_of


def understood_goals(instruction: Instruction, episode: Episode) -> tuple[Goal, ...]:
    """Return the goals that fit all of an instruction; none if it has no meaning."""
    if instruction.meaning is not None:
        return meaning.meant_goals(instruction.meaning, episode)
    return _read(instruction, instruction.text, episode)


def goals_of_command(instruction: Instruction, episode: Episode) -> tuple[Goal, ...]:
    """Return the goals that fit its last utterance alone; none if it has no meaning."""
    if instruction.meaning is not None:
        return meaning.command_goals(instruction.meaning, episode)
    return _read(instruction, instruction.command, episode)


def blind_goals(instruction: Instruction, episode: Episode) -> tuple[Goal, ...]:
    """Return the goals among which a guess is blind: those that fit the command alone.

    Where the context names the candidates, as with a rival, it is a guess among them: to pick one
    of two takes no understanding of which one is meant. None are returned without a meaning.
    """
    if instruction.meaning is not None:
        return meaning.candidate_goals(instruction.meaning, episode)
    fitting = goals_of_command(instruction, episode)
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


def _read(instruction: Instruction, text: str, episode: Episode) -> tuple[Goal, ...]:
    """Return the goals that the interpreter reads; none in a language that declares its meaning."""
    if instruction.metadata["language_version"] != LANGUAGE_VERSIONS[DEFAULT_LANGUAGE]:
        return ()
    return interpret(text, episode.scene, episode.task).goals


def _shape(goal: Goal, candidates: Collection[str]) -> list[tuple[str, SlotValue]]:
    """Return a goal with the number of values in place of those of the candidates."""
    return [
        (slot, len(set(values_in(value))) if slot in candidates else value)
        for slot, value in goal.slots
    ]


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
