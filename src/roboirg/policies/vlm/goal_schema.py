"""All goals of a task as a JSON schema, and the goal of an answer.

An answer has a field for each slot of a goal, such as ``{"color": "red", "repeats": 3}``. Where a
goal counts cubes by color, each color is a field: ``{"blue": 0, "green": 2, "red": 1}``.

The names of the slots and all their values come from the goals of the task's training scenes.
Nothing comes from the scene of the episode.
"""

from __future__ import annotations

import functools
import json
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

from roboirg.core.episode import Goal
from roboirg.core.goal_slots import COLOR_SLOTS, SLOT_TYPE_NAMES
from roboirg.tasks import Task, get_task
from roboirg.tasks.splits.splits import split_episodes
from roboirg.util.reply_reading import UnparsableReplyError, json_object, whole_number

Answer = Mapping[str, Any]
"""JSON values by field: numbers, words and lists of words."""

MAX_QUOTE_LENGTH = 80


@dataclass(frozen=True)
class Field:
    """One field of the answer.

    Attributes:
        name: of the field: a goal slot, or a color whose cubes are counted.
        kind: slot type of the value; ``amount`` for a count, ``colors`` for a list of colors.
        values: every possible value, or item of a list.
        lengths: smallest and largest length of a list; None for a single value.
    """

    name: str
    kind: str
    values: tuple[str | int, ...]
    lengths: tuple[int, int] | None = None

    @property
    def is_number(self) -> bool:
        """Whether the values are whole numbers."""
        return isinstance(self.values[0], int)

    def schema(self) -> dict[str, Any]:
        """Return the JSON schema of the field.

        ``{"type": "string", "enum": ["blue", "green", "red"]}``; a list has one as its ``items``.
        """
        kind = "integer" if self.is_number else "string"
        item: dict[str, Any] = {"type": kind, "enum": list(self.values)}
        if self.lengths is None:
            return item
        least, most = self.lengths
        return {"type": "array", "items": item, "minItems": least, "maxItems": most}

    def allows(self, value: object) -> bool:
        """Return whether a value in JSON is one of the field's."""
        if self.lengths is None:
            return self._has(value)
        least, most = self.lengths
        return (
            isinstance(value, list)
            and least <= len(value) <= most
            and all(self._has(item) for item in value)
        )

    def _has(self, item: object) -> bool:
        """Return whether a single value is one of the field's; True is not 1."""
        return type(item) is type(self.values[0]) and item in self.values


@dataclass(frozen=True)
class GoalSchema:
    """All goals of one task, and the form of an answer that names one.

    Attributes:
        fields: of an answer, in order.
        goals: every goal, by its answer as canonical JSON.
        thing: noun for the objects that have the colors.
    """

    fields: tuple[Field, ...]
    goals: Mapping[str, Goal]
    thing: str

    @functools.cached_property
    def answers(self) -> Mapping[Goal, str]:
        """The answer that names each goal, as canonical JSON."""
        return {goal: answer for answer, goal in self.goals.items()}

    def schema(self, reasoning: str | None = None) -> dict[str, Any]:
        """Return the JSON schema of an answer; `reasoning` describes a field in which to think."""
        properties: dict[str, Any] = {}
        if reasoning is not None:
            properties["reasoning"] = {"type": "string", "description": reasoning}
        properties |= {field.name: field.schema() for field in self.fields}
        return object_schema(properties)

    def read(self, text: str) -> Goal:
        """Return the goal that a reply names in a JSON object, perhaps with other words around it.

        ``'I think {"color": "Red", "repeats": "3"}'`` -> the goal *red, three times*.

        Raises:
            UnparsableReplyError: it names none; the message, which the model gets, says why.
        """
        reply = json_object(text)
        answer: dict[str, Any] = {}
        for field in self.fields:
            if field.name not in reply:
                raise UnparsableReplyError(f"The field {field.name!r} is missing.")
            answer[field.name] = _normalize(reply[field.name], field.is_number)
        goal = self.goals.get(_canonical(answer))
        if goal is not None:
            return goal
        for field in self.fields:
            value = answer[field.name]
            if not field.allows(value):
                raise UnparsableReplyError(
                    f"The field {field.name!r} cannot be {json.dumps(value)[:MAX_QUOTE_LENGTH]}; "
                    f"its values are {', '.join(map(str, field.values))}."
                )
        raise UnparsableReplyError("These values cannot be meant together.")


def object_schema(fields: Mapping[str, Mapping[str, Any]]) -> dict[str, Any]:
    """Return the JSON schema of an object with these fields, each with its schema, and no other."""
    return {
        "type": "object",
        "properties": dict(fields),
        "required": list(fields),
        "additionalProperties": False,
    }


@functools.cache
def goal_schema(task: str) -> GoalSchema:
    """Return the form of an answer that names a goal of a task, and all goals by their answers.

    The goals are those of the training split. Answers with colors that are counted have a field for
    each color; a goal has no entry for a color that it does not want, so 0 is filled in: *two red*
    -> ``{"blue": 0, "green": 0, "red": 2}``.
    """
    known_task = get_task(task)
    answers = _whole_answers(known_task)
    goals = {_canonical(answer): goal for goal, answer in answers.items()}
    fields = []
    for name in next(iter(answers.values())):
        values = [answer[name] for answer in answers.values()]
        fields.append(_field(name, values))
    return GoalSchema(tuple(fields), goals, known_task.things.colored)


def _whole_answers(task: Task) -> dict[Goal, Answer]:
    """Return the answer that names each goal of a task, with the same fields in the same order."""
    answers = {goal: _answer(goal) for goal in _training_goals(task)}
    longest = max(answers.values(), key=len)  # which has all fields
    zeros = dict.fromkeys(longest, 0)
    return {goal: {**zeros, **answer} for goal, answer in answers.items()}


def _training_goals(task: Task) -> Iterable[Goal]:
    """Return all goals of the scenes of the training split, each once, in order of appearance."""
    goals: dict[Goal, None] = {}  # a set that keeps its order
    for episode in split_episodes([task.name], ["train"]):
        goals.update(dict.fromkeys(task.goals(episode.scene)))
    return goals


def _answer(goal: Goal) -> Answer:
    """Return the answer that names a goal; of counted colors, those that it names.

    *Two red* -> ``{"red": 2}``; *red, three times* -> ``{"color": "red", "repeats": 3}``.
    """
    slots = goal.as_mapping()
    if "counts" in slots:
        return dict(goal.amounts)
    return slots


def _field(name: str, values: list[Any]) -> Field:
    """Return a field of an answer, with the values that it has in the answers of all goals.

    Args:
        name: a slot of the task; or a color, whose number is asked for.
        values: of the field; tuples of colors if it is a list.
    """
    if isinstance(values[0], tuple):
        lengths = [len(colors) for colors in values]
        items: set[Any] = set()
        for colors in values:
            items.update(colors)
        return Field(name, "colors", tuple(sorted(items)), (min(lengths), max(lengths)))
    kind: str = SLOT_TYPE_NAMES.get(name, "amount")
    if name in COLOR_SLOTS:
        kind = "color"
    return Field(name, kind, tuple(sorted(set(values))))


def _normalize(value: object, is_number: bool) -> object:
    """Return a value of a reply as goals have it: ``" Red"`` becomes ``"red"``.

    In a field of numbers, ``3.0`` and ``"3"`` become 3. A list is treated item by item.
    """
    if isinstance(value, list):
        return [_normalize(item, is_number) for item in value]
    if isinstance(value, str):
        value = value.strip().lower()
    if is_number:
        number = whole_number(value)
        return value if number is None else number
    return value


def _canonical(answer: Answer) -> str:
    """Return an answer as a text that identifies it, whatever the order of its fields."""
    # JSON distinguishes true and 1.0 from 1; Python dictionaries do not.
    return json.dumps(answer, sort_keys=True)
