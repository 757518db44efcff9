"""Whole sentences for single goals, such as RoboMME's: read them, and say them.

They serve the explicit setting, instead of commands.
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
from roboirg.language.scenarios.written import Mistakes, converted, fields_of, shown
from roboirg.tasks import goals_of
from roboirg.tasks.splits.splits import get_episode

Literals = Mapping[Goal, str]
"""The sentence of each goal."""


class LiteralFields(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A sentence as it was written.

    Attributes:
        task: whose goal it states.
        when: the goal, a value for each of its slots.
        text: the sentence.
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
    """
    sentences_by_task: dict[str, dict[Goal, str]] = {task: {} for task in tasks}
    for number, table in enumerate(written, 1):
        part = mistakes.at(f"literal {number}")
        literal = fields_of(table, LiteralFields, part)
        if literal is None:
            continue
        if literal.task not in tasks:
            part.check_names("task", [literal.task], tasks)
            continue
        with part.kept():
            _add_literal(literal, sentences_by_task[literal.task], part.where)
    return sentences_by_task


def _add_literal(literal: LiteralFields, sentences: dict[Goal, str], where: str) -> None:
    """Add a sentence to those of its task, by its goal."""
    goal = _goal(literal, where)
    if goal in sentences:
        raise InvalidValueError(
            f"{where} states the goal {in_words(goal)} of {literal.task} again."
        )
    sentences[goal] = _sentence(literal.text, where)


def _goal(literal: LiteralFields, where: str) -> Goal:
    """Return the goal that a sentence is for: ``when = {color = "red", repeats = 2}`` as a goal.

    It must have a value of the right type for each slot of the task's goals. `where` names the
    sentence in messages.
    """
    example_slots = _example(literal.task).as_mapping()
    if literal.when.keys() != example_slots.keys():
        given = shown(dict(literal.when))
        raise InvalidValueError(
            f"{where} has when = {given}; it must have a value for {' and '.join(example_slots)}."
        )
    values: dict[str, SlotValue] = {}
    for slot, content in example_slots.items():
        kind = _kind_of(content)
        values[slot] = converted(literal.when[slot], kind, f"{where}, when.{slot}")
    try:
        return unordered(Goal.of(**values))
    except ValueError:
        raise InvalidValueError(
            f"{where} has when = {shown(values)}; it must have a count for each color."
        ) from None


def _kind_of(content: SlotValue) -> Any:  # noqa: ANN401 - mypy knows no type of a type form
    """Return the type of what a slot holds: ``str``, ``int``, or a tuple of either."""
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
    """Return the words of a sentence, which has no marks."""
    try:
        parts = parse(text)
    except ValueError as error:
        raise InvalidValueError(f"{where} {error}.") from None
    if not text.strip() or any(not isinstance(part, TaggedText) for part in parts):
        raise InvalidValueError(f"{where} has the text {shown(text)}; it must be a whole sentence.")
    return text


def literal_refusal(request: InstructionRequest, words: TaskScenarios) -> str | None:
    """Return why there is no sentence for an episode; None if there is one."""
    goal = request.episode.goal
    if unordered(goal) in words.literals:
        return None
    whose = f"the wording file {request.options.wordings}"
    return f"{whose} has no sentence of {request.task.name} for the goal: {in_words(goal)}"


def in_words(goal: Goal) -> str:
    """Return a goal in words, for messages."""
    return describe_goal(goal.as_mapping())


def say_literal(request: InstructionRequest, words: TaskScenarios) -> InstructionSpec:
    """Return the wording file's sentence for an episode, as an instruction without fields.

    It means every goal of the scene for which the file has the same sentence.
    """
    goal = request.episode.goal
    sentence = words.literals[unordered(goal)]
    meant_goals: list[Goal] = []
    for possible_goal in dict.fromkeys((goal, *goals_of(request.episode))):
        if words.literals.get(unordered(possible_goal)) == sentence:
            meant_goals.append(possible_goal)
    command = UtteranceSpec("command", plain(sentence))
    return InstructionSpec((command,), Meaning({}, goals=tuple(meant_goals)), {"command": sentence})
