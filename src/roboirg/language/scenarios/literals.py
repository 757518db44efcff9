"""Whole sentences for single goals, such as RoboMME's: read them, and say them.

A wording file may have them, *Pick up the red cube twice.* for one goal; the explicit setting says
them instead of commands with slots.
"""

from __future__ import annotations

import functools
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import msgspec

from roboirg.core.episode import Goal, SlotValue, describe_goal
from roboirg.core.errors import InvalidValueError
from roboirg.language.goal_fields import unordered
from roboirg.language.instruction import Meaning
from roboirg.language.phrases import TaggedText, plain
from roboirg.language.request import InstructionRequest, InstructionSpec, UtteranceSpec
from roboirg.language.scenarios.markup import parse
from roboirg.language.scenarios.scenario import TaskScenarios
from roboirg.language.scenarios.written import Mistakes, convert, excerpt, read_table
from roboirg.tasks import goals_of
from roboirg.tasks.splits.splits import get_episode

Literals = Mapping[Goal, str]
"""The sentence of each goal."""


class LiteralFields(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A whole sentence of a wording file, as its author wrote it.

    Attributes:
        task: whose goal it states: ``PickXtimes``.
        when: the goal, a value for each of its slots: ``{"color": "red", "repeats": 2}``.
        text: the sentence: *Pick up the red cube twice.*
    """

    task: str
    when: Mapping[str, Any]
    text: str


def read_literals(
    written: Iterable[dict[str, Any]], tasks: Sequence[str], mistakes: Mistakes
) -> dict[str, dict[Goal, str]]:
    """Return the whole sentences of a wording file by task, and there by the goal that they state.

    ``{"StopCube": {<goal>: "Stop it at the third visit."}}``; the goal as `unordered` has it. What
    is wrong with a sentence is added to `mistakes`, and the sentence is left out.

    Args:
        written: a table for each sentence, as it stands in the file.
        tasks: those that the file serves.
        mistakes: of the file.
    """
    sentences_by_task: dict[str, dict[Goal, str]] = {task: {} for task in tasks}
    for number, table in enumerate(written, 1):
        part = mistakes.at(f"literal {number}")
        literal = read_table(table, LiteralFields, part)
        if literal is None:
            continue
        if literal.task not in tasks:
            part.check_names("task", [literal.task], tasks)
            continue
        with part.collecting():
            _add_literal(literal, sentences_by_task[literal.task], part.where)
    return sentences_by_task


def _add_literal(literal: LiteralFields, sentences: dict[Goal, str], where: str) -> None:
    """Add a sentence to those of its task, by its goal.

    Raises:
        InvalidValueError: the goal or the text is wrong, or the goal has a sentence already;
            `where` names the sentence.
    """
    goal = _goal(literal, where)
    if goal in sentences:
        raise InvalidValueError(
            f"{where} states the goal {in_words(goal)} of {literal.task} again."
        )
    sentences[goal] = _sentence(literal.text, where)


def _goal(literal: LiteralFields, where: str) -> Goal:
    """Return the goal that a sentence is for: ``when = {color = "red", repeats = 2}`` as a goal.

    Raises:
        InvalidValueError: it has not a value of the right type for each slot of the task's goals;
            `where` names the sentence.
    """
    example_slots = _example(literal.task).as_mapping()
    if literal.when.keys() != example_slots.keys():
        given = excerpt(dict(literal.when))
        raise InvalidValueError(
            f"{where} has when = {given}; it must have a value for {' and '.join(example_slots)}."
        )
    values = {}
    for slot, content in example_slots.items():
        kind = _kind_of(content)
        values[slot] = convert(literal.when[slot], kind, f"{where}, when.{slot}")
    try:
        return unordered(Goal.of(**values))
    except ValueError:
        raise InvalidValueError(
            f"{where} has when = {excerpt(values)}; it must have a count for each color."
        ) from None


def _kind_of(content: SlotValue) -> Any:  # noqa: ANN401 - mypy knows no type of a type form
    """Return the type of what a slot holds: ``str``, ``int``, or a tuple of either.

    ``"red"`` gives ``str``, and ``(2, 1)`` gives ``tuple[int, ...]``.
    """
    if not isinstance(content, tuple):
        return type(content)
    if isinstance(content[0], int):
        return tuple[int, ...]
    return tuple[str, ...]


@functools.cache
def _example(task: str) -> Goal:
    """Return a goal of a task, which has the slots of all of its goals."""
    return get_episode(task, "random", 0).goal


def _sentence(text: str, where: str) -> str:
    """Return the text of a whole sentence; it must not be empty or have slots such as ``{color}``.

    Raises:
        InvalidValueError: it is empty or has slots; `where` names the sentence.
    """
    try:
        parts = parse(text)
    except ValueError as error:
        raise InvalidValueError(f"{where} {error}.") from None
    if not text.strip() or any(not isinstance(part, TaggedText) for part in parts):
        raise InvalidValueError(
            f"{where} has the text {excerpt(text)}; it must be a whole sentence."
        )
    return text


def literal_refusal(request: InstructionRequest, words: TaskScenarios) -> str | None:
    """Return why a wording file has no whole sentence for an episode's goal; None if it has one.

    ``the wording file mine@1a2b3c4d has no sentence of PickXtimes for the goal: red, twice``
    """
    goal = request.episode.goal
    if unordered(goal) in words.literals:
        return None
    whose = f"the wording file {request.options.wordings}"
    return f"{whose} has no sentence of {request.task.name} for the goal: {in_words(goal)}"


def in_words(goal: Goal) -> str:
    """Return a goal in words, for messages: *red, 3 times*."""
    return describe_goal(goal.as_mapping())


def say_literal(request: InstructionRequest, words: TaskScenarios) -> InstructionSpec:
    """Return the wording file's sentence for an episode as an instruction of one utterance.

    It has no mentions. It means every goal of the scene for which the file has the same sentence,
    so a vague sentence, *Do it.*, may mean several. The file must have one (`literal_refusal`).
    """
    goal = request.episode.goal
    sentence = words.literals[unordered(goal)]
    meant_goals = []
    for possible_goal in dict.fromkeys((goal, *goals_of(request.episode))):
        if words.literals.get(unordered(possible_goal)) == sentence:
            meant_goals.append(possible_goal)
    command = UtteranceSpec("command", plain(sentence))
    return InstructionSpec((command,), Meaning({}, goals=tuple(meant_goals)), {"command": sentence})
