"""What a person answers in a task: things to point at in the picture, then values to choose.

Pointing asks for what the words leave to the eye: which container hides the red cube has to be seen
and remembered. Values are asked for only where pointing leaves them open, as for numbers.
"""

from __future__ import annotations

import functools
import json
from collections import Counter, defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

from roboirg.core.episode import Episode, Goal, ObjectKind
from roboirg.core.errors import InvalidValueError
from roboirg.evaluation.grounding_items.referents import find_referents, is_ordered
from roboirg.policies.vlm.goal_schema import SOURCE, Field, goal_schema
from roboirg.tasks import goals_of, with_goal
from roboirg.tasks.splits.splits import split_episodes

Value = str | int


class AnswerForm(NamedTuple):
    """What there is to answer in a task.

    Attributes:
        kinds: of the things to point at, in order.
        least: how many of them every answer has; others may be left out, from the last one.
        fields: values to choose.
    """

    kinds: tuple[ObjectKind, ...]
    least: int
    fields: tuple[Field, ...]


class FormAnswer(NamedTuple):
    """An answer.

    Attributes:
        objects: names of the things that were pointed at, in order.
        values: chosen value of each field.
    """

    objects: tuple[str, ...]
    values: Mapping[str, Value]

    @property
    def category(self) -> str:
        """The answer as text: equal for equal answers."""
        return json.dumps([self.objects, self.values], sort_keys=True)


@functools.cache
def answer_form(task: str) -> AnswerForm:
    """Return the form of a task, found from the goals of its training scenes.

    Raises:
        UnknownNameError: there is no such task.
    """
    fields = goal_schema(task).fields
    names: set[str] = set()
    most: Counter[ObjectKind] = Counter()
    shapes: set[tuple[ObjectKind, ...]] = set()
    for episode in split_episodes([task], [SOURCE]):
        goals = goals_of(episode)
        if not is_ordered(goals[0]):
            return AnswerForm((), 0, fields)
        by_objects: dict[tuple[str, ...], list[Goal]] = defaultdict(list)
        for goal in goals:
            by_objects[_pointed(episode, goal)].append(goal)
        for alike in by_objects.values():
            names |= _open_slots(episode, alike)
        most |= Counter(one.kind for one in episode.scene.objects)
        shapes |= {tuple(episode.scene[one].kind for one in objects) for objects in by_objects}
    # Of a kind of which there is only one, there is nothing to choose.
    found = {tuple(kind for kind in shape if most[kind] > 1) for shape in shapes}
    longest = max(found, key=len)
    if any(shape != longest[: len(shape)] for shape in found):
        raise InvalidValueError(f"{task} has goals that cannot be answered by one form: {found}.")
    open_fields = tuple(field for field in fields if field.name in names)
    return AnswerForm(longest, min(map(len, found)), open_fields)


def answer_of(episode: Episode, goal: Goal) -> FormAnswer:
    """Return the answer that means a goal of the scene."""
    form = answer_form(episode.task)
    slots = json.loads(goal_schema(episode.task).answers[goal])
    objects = _pointed(episode, goal) if form.kinds else ()
    return FormAnswer(
        tuple(one for one in objects if episode.scene[one].kind in form.kinds),
        {field.name: slots[field.name] for field in form.fields},
    )


def goal_of(episode: Episode, answer: FormAnswer) -> Goal | None:
    """Return the goal that an answer means; None if the scene has no such goal."""
    goals = goals_of(episode)
    return next((goal for goal in goals if answer_of(episode, goal) == answer), None)


def checked_answer(
    episode: Episode, objects: Sequence[str], values: Mapping[str, object]
) -> FormAnswer:
    """Return an answer if it fills the form.

    Args:
        episode: the episode.
        objects: names of objects of the scene.
        values: of the fields, not checked yet.

    Raises:
        InvalidValueError: something is missing, too much, or not among the choices.
    """
    form = answer_form(episode.task)
    kinds = tuple(episode.scene[one].kind for one in objects)
    if not form.least <= len(kinds) or kinds != form.kinds[: len(kinds)]:
        raise InvalidValueError(
            f"The answer points at {', '.join(kinds) or 'nothing'}; it must point at "
            f"{', '.join(form.kinds) or 'nothing'}, in this order."
        )
    if len(set(objects)) < len(objects):
        raise InvalidValueError("The answer points at the same thing twice.")
    chosen: dict[str, Value] = {}
    for field in form.fields:
        value = values.get(field.name)
        if not isinstance(value, str | int) or type(value) is not type(field.values[0]):
            raise InvalidValueError(f"The answer has no {field.name!r}.")
        if value not in field.values:
            raise InvalidValueError(
                f"{field.name!r} is {value!r}; it must be one of {field.values}."
            )
        chosen[field.name] = value
    return FormAnswer(tuple(objects), chosen)


def _pointed(episode: Episode, goal: Goal) -> tuple[str, ...]:
    """Return the objects that a goal means, in the order in which they are handled."""
    found = find_referents(replace(episode, goal=goal))
    return tuple(one.objects[0] for one in found)


def _open_slots(episode: Episode, goals: Sequence[Goal]) -> set[str]:
    """Return the slots in which goals differ that are not the same to the judge."""
    distinct = {with_goal(episode, goal).stages: goal for goal in goals}
    slots = [goal.as_mapping() for goal in distinct.values()]
    return {name for name in slots[0] for one in slots if one[name] != slots[0][name]}
