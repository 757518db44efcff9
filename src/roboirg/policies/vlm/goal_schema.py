"""All goals of a task as a JSON schema, and the goal of an answer.

The names of the slots and all their values come from the goals of the task's training scenes.
Nothing comes from the scene of the episode.
"""

from __future__ import annotations

import functools
import json
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from roboirg.core.episode import Goal
from roboirg.core.goal_slots import COLOR_SLOTS, SLOT_TYPE_NAMES
from roboirg.tasks import get_task
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
        """Return the JSON schema of the field."""
        kind = "integer" if self.is_number else "string"
        one: dict[str, Any] = {"type": kind, "enum": list(self.values)}
        if self.lengths is None:
            return one
        least, most = self.lengths
        return {"type": "array", "items": one, "minItems": least, "maxItems": most}

    def allows(self, value: object) -> bool:
        """Return whether a value in JSON is one of the field's."""
        items = [value] if self.lengths is None else value
        least, most = self.lengths or (1, 1)
        return (
            isinstance(items, list)
            and least <= len(items) <= most
            and all(type(one) is type(self.values[0]) and one in self.values for one in items)
        )


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
        """Return the goal that a reply names.

        Raises:
            UnparsableReplyError: it names none; the message says why.
        """
        reply = json_object(text)
        answer = {}
        for field in self.fields:
            if field.name not in reply:
                raise UnparsableReplyError(f"The field {field.name!r} is missing.")
            answer[field.name] = _normalize(reply[field.name], field.is_number)
        goal = self.goals.get(_canonical(answer))
        if goal is not None:
            return goal
        for field in self.fields:
            if not field.allows(answer[field.name]):
                raise UnparsableReplyError(
                    f"The field {field.name!r} cannot be "
                    f"{json.dumps(answer[field.name])[:MAX_QUOTE_LENGTH]}; "
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
    """Return the goal schema of a task."""
    known_task = get_task(task)
    episodes = split_episodes([known_task.name], ["train"])
    goals = dict.fromkeys(goal for episode in episodes for goal in known_task.goals(episode.scene))
    answers = [_answer(goal) for goal in goals]
    names = max(answers, key=len)
    # A goal does not name the colors of which it has none.
    zeros = dict.fromkeys(names, 0)
    filled = [{**zeros, **answer} for answer in answers]
    fields = tuple(_field(name, [answer[name] for answer in filled]) for name in names)
    named = dict(zip(map(_canonical, filled), goals, strict=True))
    return GoalSchema(fields, named, known_task.commands.colored)


def _answer(goal: Goal) -> Answer:
    """Return the answer that names a goal; of counted colors, those that it names."""
    slots = goal.as_mapping()
    if "counts" in slots:
        return dict(goal.amounts)
    return slots


def _field(name: str, values: list[Any]) -> Field:
    """Return a field with all its values; a name that is no slot's is a color that is counted."""
    kind: str = "color" if name in COLOR_SLOTS else SLOT_TYPE_NAMES.get(name, "amount")
    lengths = None
    if isinstance(values[0], tuple):
        kind, lengths = "colors", (min(map(len, values)), max(map(len, values)))
        values = [item for value in values for item in value]
    return Field(name, kind, tuple(sorted(set(values))), lengths)


def _normalize(value: object, is_number: bool) -> object:
    """Return a value with its words in lower case and stripped; 3.0 and "3" become 3."""
    if isinstance(value, list):
        return [_normalize(item, is_number) for item in value]
    if isinstance(value, str):
        value = value.strip().lower()
    number = whole_number(value) if is_number else None
    return value if number is None else number


def _canonical(answer: Answer) -> str:
    # JSON distinguishes true and 1.0 from 1; Python dictionaries do not.
    return json.dumps(answer, sort_keys=True)
