"""All goals of a task as a JSON schema, and the goal of an answer.

The names of the slots and all their values come from the goals of the task's training scenes.
Nothing comes from the scene of the episode.
"""

from __future__ import annotations

import functools
import json
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

from roboirg.core.episode import Goal, SlotValue, Split
from roboirg.core.goal_slots import COLOR_SLOTS, SLOT_TYPE_NAMES
from roboirg.tasks import get_task
from roboirg.tasks.splits.splits import split_episodes
from roboirg.util.json_reply import UnparsableReplyError, json_object

Answer = Mapping[str, Any]
"""JSON values by field: numbers, words and lists of words."""

SOURCE: Split = "train"
AMOUNT = "amount"
LISTED = "colors"
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

    def schema(self) -> dict[str, Any]:
        """Return the JSON schema of the field."""
        kind = "integer" if isinstance(self.values[0], int) else "string"
        one: dict[str, Any] = {"type": kind, "enum": list(self.values)}
        if self.lengths is None:
            return one
        least, most = self.lengths
        return {"type": "array", "items": one, "minItems": least, "maxItems": most}


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
        return {
            "type": "object",
            "properties": properties,
            "required": list(properties),
            "additionalProperties": False,
        }

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
            answer[field.name] = _normalize(reply[field.name])
        try:
            return self.goals[_canonical(answer)]
        except KeyError:
            pass
        for field in self.fields:
            if not _allowed(answer[field.name], field):
                raise UnparsableReplyError(
                    f"The field {field.name!r} cannot be "
                    f"{json.dumps(answer[field.name])[:MAX_QUOTE_LENGTH]}; "
                    f"its values are {', '.join(map(str, field.values))}."
                )
        raise UnparsableReplyError("These values cannot be meant together.")


@functools.cache
def goal_schema(task: str) -> GoalSchema:
    """Return the goal schema of a task."""
    known_task = get_task(task)
    goals: dict[str, Goal] = {}
    for episode in split_episodes([known_task.name], [SOURCE]):
        for goal in known_task.goals(episode.scene):
            goals.setdefault(_canonical(_answer(goal)), goal)
    return _complete(goals, known_task.commands.colored)


def _answer(goal: Goal) -> dict[str, Any]:
    """Return the answer that names a goal; colors with a count of 0 are left out."""
    slots = goal.as_mapping()
    if "counts" in slots:
        return dict(zip(goal.texts("colors"), goal.numbers("counts"), strict=True))
    return {
        slot: list(value) if isinstance(value, tuple) else value for slot, value in slots.items()
    }


def _complete(goals: Mapping[str, Goal], thing: str) -> GoalSchema:
    """Return the schema of all goals; amounts that a goal does not name are 0."""
    answers = [_answer(goal) for goal in goals.values()]
    names = max(answers, key=len).keys()
    counted = any("counts" in goal.as_mapping() for goal in goals.values())
    fields = tuple(_field(name, [one.get(name, 0) for one in answers], counted) for name in names)
    order = {field.name: 0 for field in fields}
    filled = {
        _canonical(order | answer): goal
        for answer, goal in zip(answers, goals.values(), strict=True)
    }
    return GoalSchema(fields, filled, thing)


def _field(name: str, values: Iterable[SlotValue | list[str]], counted: bool) -> Field:
    values = list(values)
    if counted:
        return Field(name, AMOUNT, _sorted(values))
    if isinstance(values[0], list):
        items = _sorted(item for value in values if isinstance(value, list) for item in value)
        lengths = [len(value) for value in values if isinstance(value, list)]
        return Field(name, LISTED, items, (min(lengths), max(lengths)))
    kind = "color" if name in COLOR_SLOTS else SLOT_TYPE_NAMES[name]
    return Field(name, kind, _sorted(values))


def _sorted(values: Iterable[Any]) -> tuple[Any, ...]:
    return tuple(sorted(set(values)))


def _allowed(value: object, field: Field) -> bool:
    if field.lengths is None:
        return type(value) is type(field.values[0]) and value in field.values
    least, most = field.lengths
    return (
        isinstance(value, list)
        and least <= len(value) <= most
        and all(item in field.values for item in value)
    )


def _normalize(value: object) -> object:
    """Return a value with its words in lower case and stripped."""
    if isinstance(value, str):
        return value.strip().lower()
    return [_normalize(item) for item in value] if isinstance(value, list) else value


def _canonical(answer: Answer) -> str:
    # JSON distinguishes true and 1.0 from 1; Python dictionaries do not.
    return json.dumps(answer, sort_keys=True)
