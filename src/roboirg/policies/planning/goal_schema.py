"""What can be meant in a task, as a JSON schema, and how an answer becomes a goal.

Everything follows from the goals that the task has in its training scenes: the names of the slots
and all their possible values. Nothing is taken from the scene that is being played.
"""

from __future__ import annotations

import functools
import json
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

from roboirg.core.episode import Goal, SlotValue, Split
from roboirg.episodes.splits import SIZES, get_episode
from roboirg.language.request import COLOR_SLOTS, SLOT_TYPE_NAMES
from roboirg.policies.planning.vlm_query import UnparsableReply, json_object
from roboirg.tasks import get_task

Answer = Mapping[str, Any]
"""JSON values by field: numbers, words and lists of words."""

SOURCE: Split = "train"
AMOUNT = "amount"
LISTED = "colors"
LONGEST_QUOTE = 80


@dataclass(frozen=True)
class Field:
    """One field of the answer.

    Attributes:
        name: of the field: a goal slot, or a color whose cubes are counted.
        kind: what kind of value it holds, as in the goal's slots; ``colors`` for several.
        values: every value it can have, or that an item of it can have.
        lengths: of a list, its least and its greatest length; None for one value.
    """

    name: str
    kind: str
    values: tuple[str | int, ...]
    lengths: tuple[int, int] | None = None

    def schema(self) -> dict[str, Any]:
        """JSON schema of the field."""
        kind = "integer" if isinstance(self.values[0], int) else "string"
        one: dict[str, Any] = {"type": kind, "enum": list(self.values)}
        if self.lengths is None:
            return one
        least, most = self.lengths
        return {"type": "array", "items": one, "minItems": least, "maxItems": most}


@dataclass(frozen=True)
class GoalSchema:
    """All that can be meant in one task.

    Attributes:
        fields: of an answer, in order.
        goals: every goal, by its answer as canonical JSON.
        thing: what has the colors, in words.
    """

    fields: tuple[Field, ...]
    goals: Mapping[str, Goal]
    thing: str

    def schema(self, reasoning: str | None = None) -> dict[str, Any]:
        """JSON schema of an answer; with `reasoning`, the words for a field in which to think."""
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
        """The goal that a reply names.

        Raises:
            UnparsableReply: it names none; the sentence says what is wrong.
        """
        reply = json_object(text)
        answer = {}
        for field in self.fields:
            if field.name not in reply:
                raise UnparsableReply(f"The field {field.name!r} is missing.")
            answer[field.name] = _tidy(reply[field.name])
        try:
            return self.goals[_canonical(answer)]
        except KeyError:
            pass
        for field in self.fields:
            if not _allowed(answer[field.name], field):
                raise UnparsableReply(
                    f"The field {field.name!r} cannot be "
                    f"{json.dumps(answer[field.name])[:LONGEST_QUOTE]}; "
                    f"its values are {', '.join(map(str, field.values))}."
                )
        raise UnparsableReply("These values cannot be meant together.")


@functools.cache
def goal_schema(task: str) -> GoalSchema:
    """All that can be meant in a task.

    Raises:
        UnknownNameError: there is no such task.
    """
    known = get_task(task)
    goals: dict[str, Goal] = {}
    for index in range(SIZES[SOURCE]):
        for goal in known.goals(get_episode(task, SOURCE, index).scene):
            goals.setdefault(_canonical(answer_for(goal)), goal)
    return _complete(goals, known.commands.colored)


def answer_for(goal: Goal) -> dict[str, Any]:
    """The answer that names a goal; colors it counts none of are left out."""
    slots = goal.as_mapping()
    if "counts" in slots:
        return dict(zip(goal.texts("colors"), goal.numbers("counts"), strict=True))
    return {
        slot: list(value) if isinstance(value, tuple) else value for slot, value in slots.items()
    }


def full_answer(goal: Goal, slots: GoalSchema) -> dict[str, Any]:
    """The answer that names a goal, every field of the task filled."""
    answer = answer_for(goal)
    return {field.name: answer.get(field.name, 0) for field in slots.fields}


def _complete(goals: Mapping[str, Goal], thing: str) -> GoalSchema:
    """Fields from all goals; amounts that a goal does not name are 0."""
    answers = [answer_for(goal) for goal in goals.values()]
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
    held = list(values)
    if counted:
        return Field(name, AMOUNT, _sorted(held))
    if isinstance(held[0], list):
        items = _sorted(item for value in held if isinstance(value, list) for item in value)
        lengths = [len(value) for value in held if isinstance(value, list)]
        return Field(name, LISTED, items, (min(lengths), max(lengths)))
    kind = "color" if name in COLOR_SLOTS else SLOT_TYPE_NAMES[name]
    return Field(name, kind, _sorted(held))


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


def _tidy(value: object) -> object:
    """Words as they are compared."""
    if isinstance(value, str):
        return value.strip().lower()
    return [_tidy(item) for item in value] if isinstance(value, list) else value


def _canonical(answer: Answer) -> str:
    # JSON keeps true from 1 and 1.0 from 1, which Python would not.
    return json.dumps(answer, sort_keys=True)
