"""The independent reader: from words and a scene to all the goals that fit.

It shares nothing with the rooms that make the words: no template, constant or metadata. It knows
English as far as the benchmark needs it, the objects on the table, what moves and what the video
shows, and which goals a task can have at all.
"""

from __future__ import annotations

import functools
from typing import NamedTuple

from roboirg.core.episode import Goal, Scene
from roboirg.language.interpreter.command import is_command, read_command
from roboirg.language.interpreter.constraints import tests_for
from roboirg.language.interpreter.discourse_context import read_discourse
from roboirg.language.interpreter.reference_resolution import ReferenceResolver
from roboirg.language.interpreter.temporal_relations import time_told
from roboirg.language.interpreter.tokens import Sentence, split_sentences
from roboirg.tasks import get_task

__all__ = ["Interpretation", "interpret"]


class Interpretation(NamedTuple):
    """The outcome of reading.

    Attributes:
        goals: every goal that fits the text; one if the text says all, none if it contradicts
            itself or the scene.
        not_understood: what was pointed at without having been introduced, and the like.
    """

    goals: tuple[Goal, ...]
    not_understood: tuple[str, ...]


def interpret(text: str, scene: Scene, task: str) -> Interpretation:
    """All goals of a task that fit what is said; any text will do, whole prompts or their ends.

    Args:
        text: the prompt.
        scene: what the robot may know: objects, colors, positions, what moves; and from the
            video what was done, and which cube is under which container.
        task: name of the task.

    Raises:
        UnknownNameError: there is no such task.
    """
    candidates = _possible_goals(scene, task)
    sentences = split_sentences(text)
    first, last = _command_span(sentences)
    context = read_discourse(sentences[:first])
    order: Sentence = tuple(word for part in sentences[first:last] for word in (*part, ","))
    command = read_command(order)
    listener = ReferenceResolver(scene, context, context.times | time_told(command.text))
    slots = candidates[0].as_mapping() if candidates else ()
    tests = tests_for(slots, command, listener)
    goals = tuple(goal for goal in candidates if all(fits(goal) for fits in tests))
    complaints = listener.complaints if first < last else ["no command", *listener.complaints]
    return Interpretation(goals, tuple(dict.fromkeys(complaints)))


@functools.lru_cache(maxsize=64)
def _possible_goals(scene: Scene, task: str) -> tuple[Goal, ...]:
    # Kept, because the same scene is read about in many settings.
    return get_task(task).goals(scene)


def _command_span(sentences: tuple[Sentence, ...]) -> tuple[int, int]:
    """Where the last run of commanding sentences begins and ends."""
    last = len(sentences)
    while last and not is_command(sentences[last - 1]):
        last -= 1
    first = last
    while first and is_command(sentences[first - 1]):
        first -= 1
    return (first, last) if last else (len(sentences), len(sentences))
