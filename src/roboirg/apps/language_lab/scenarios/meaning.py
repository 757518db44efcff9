"""What a scenario means by declaration: the operations of its pointers on what it introduces."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from roboirg.core.episode import Goal, Scene
from roboirg.language.instruction import Expression
from roboirg.language.landmarks import selectors
from roboirg.language.request import InstructionRequest
from roboirg.language.scenarios.choice import Chosen
from roboirg.language.scenarios.introduced import Introduced, IntroducedValue
from roboirg.language.scenarios.markup import Pointer, Text, pointers_in
from roboirg.language.scenarios.scenario import PointerRow
from roboirg.language.scenarios.scenario_file import row_of, type_of

Value = str | int | None
_RANKS: Mapping[Expression | str, int] = {
    "former": 0, "latter": 1, "first": 0, "second": 1, "third": 2, "last": -1,
}  # fmt: skip
_STEPS = {"before": -1, "after": 1, "two before": -2, "two after": 2}


def meant_value(
    request: InstructionRequest, chosen: Chosen, field: str, text: Text, introduced: Introduced
) -> Value:
    """Return the value that the words for a field give; None if they give none.

    `introduced` is what the words name, of which the goal's own values are not looked at.
    """
    scenario = chosen.scenario.fields
    found = list(pointers_in(text))
    if not found:
        return None
    pointer = found[-1]
    row = row_of(text, pointer, type_of(pointer.of, scenario.list))
    if row is None:
        return None
    if chosen.remark and field == chosen.scenario.said[0]:
        return _by_remark(chosen, introduced)
    if chosen.remark and row.operation == "other":
        taken = _by_remark(chosen, introduced)
        return next(one.value for one in introduced.values["list"] if one.value != taken)
    return _operate(request, row, pointer, introduced, chosen.introduced)


def _by_remark(chosen: Chosen, introduced: Introduced) -> Value:
    """Return what a remark chooses: the one that it points at, or of two the other one."""
    at = _RANKS[chosen.remark.removeprefix("not_")]
    values = introduced.values["list"]
    return values[1 - at if chosen.remark.startswith("not_") else at].value


def _operate(
    request: InstructionRequest,
    row: PointerRow,
    pointer: Pointer,
    introduced: Introduced,
    original: Introduced,
) -> Value:
    """Return what an operation gives; a rank is that of the original introduction."""
    values = introduced.values
    operation = row.operation
    if operation == "rank":
        listed = values.get("list") or values.get(pointer.of.partition(".")[0], ())
        expression: Expression | str = pointer.expression
        if expression == "rank":
            _, expression = original.ranked(pointer.of, ordinals="ordinal" in pointer.words)
        at = _RANKS[expression]
        return listed[at].value if at < len(listed) else None
    if operation == "other":
        both = values.get("excluded") or values.get("list", ())
        left = [one.value for one in both if one.value != values["taken"][0].value]
        return left[0] if len(left) == 1 else None
    if operation == "without":
        excluded = {one.value for one in values["excluded"]}
        left = [color for color in request.scene_colors if color not in excluded]
        return left[0] if len(left) == 1 else None
    if operation == "place":
        return _at(request, values[pointer.of][0].words)
    if operation in ("same", "seen"):
        return values[pointer.of][0].value
    return _counted(operation, values)


def _counted(operation: str, values: Mapping[str, Sequence[IntroducedValue]]) -> Value:
    number = int(values["reference"][0].value)
    step = int(values["step"][0].value) if "step" in values else 0
    if operation in _STEPS:
        return number + _STEPS[operation]
    return {
        "minus": number - step, "earlier": number - step, "plus": number + step,
        "later": number + step, "double": number * 2, "half": number // 2,
    }[operation]  # fmt: skip


def _at(request: InstructionRequest, phrase: str) -> Value:
    """Return the color of what stands at a place; of a container, that of the cube in it."""
    scene: Scene = request.episode.scene
    for one in selectors(scene, request.task.commands.pointed, request.frame):
        if one.landmark.phrase == phrase:
            item = one.select()
            if item is None:
                return None
            cube = scene.hidden_in(item.name) if item.color is None else item
            return None if cube is None else cube.color
    return None


def exchanged(request: InstructionRequest, introduced: Introduced) -> Introduced:
    """Return the same with other values in place of those that are introduced."""
    values = dict(introduced.values)
    for name, found in introduced.values.items():
        if name == "list" or (len(found) > 1 and name in request.episode.goal.as_mapping()):
            values[name] = (*found[1:], found[0])
        elif name == "reference":
            # By two, because half of an odd number is none.
            values[name] = (found[0]._replace(value=int(found[0].value) + 2),)
        elif name == "taken":
            both = introduced.values.get("list") or introduced.values.get("excluded", found)
            values[name] = tuple(one for one in both if one.value != found[0].value)[:1] or found
        elif name in {one.field for one in request.goal_values}:
            values[name] = (found[0]._replace(value=_another(request, found[0])),)
        elif name == "excluded":
            target = request.color_values[0].value
            values[name] = (found[0]._replace(value=target), *found[1:])
    return Introduced(values, introduced.notes)


def _another(request: InstructionRequest, one: IntroducedValue) -> str | int:
    if isinstance(one.value, int):
        return one.value + 1
    return next(other for other in request.other_colors(one.value))


def open_goals(request: InstructionRequest, fields: Sequence[str]) -> list[Goal]:
    """Return the goals of the scene that agree with the episode's but in the fields left open."""
    goal = request.episode.goal.as_mapping()
    open_slots = {field.partition(".")[0] for field in fields}
    size = {slot: len(value) for slot, value in goal.items() if isinstance(value, tuple)}
    return [
        one
        for one in request.task.goals(request.episode.scene)
        if all(value == goal[slot] for slot, value in one.slots if slot not in open_slots)
        and all(len(one.texts(slot)) == length for slot, length in size.items())
    ]
