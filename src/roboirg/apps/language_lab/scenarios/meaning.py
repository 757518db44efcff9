"""What a scenario means by declaration: the operations of its pointers on what it introduces."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from roboirg.language.request import InstructionRequest
from roboirg.language.scenarios.choice import Chosen
from roboirg.language.scenarios.introduced import IntroducedValue
from roboirg.language.scenarios.markup import Pointer, Text, pointers_in

Value = str | int | None
_RANKS = {"former": 0, "latter": 1, "first": 0, "second": 1, "third": 2, "last": -1}


def meant_value(request: InstructionRequest, chosen: Chosen, field: str, text: Text) -> Value:
    """Return the value that the words for a field give; None if they give none."""
    found = list(pointers_in(text))
    if not found:
        return None
    pointer, values = found[-1], chosen.introduced.values
    if not chosen.remark:
        return _operate(request, pointer, values)
    # A remark chooses the one that it points at, or of two the other one.
    at = _RANKS[chosen.remark.removeprefix("not_")] ^ chosen.remark.startswith("not_")
    if field == chosen.scenario.said[0] or pointer.operation != "other":
        return values["list"][at].value
    return values["list"][1 - at].value


def _operate(
    request: InstructionRequest, pointer: Pointer, values: Mapping[str, Sequence[IntroducedValue]]
) -> Value:
    operation, expression = pointer.operation, pointer.expression
    if operation == "rank" and expression in _RANKS:
        listed = values.get("list") or values[pointer.of.partition(".")[0]]
        at = _RANKS[expression]
        return listed[at].value if at < len(listed) else None
    if operation in ("other", "without"):
        both = values.get("excluded") or values.get("list", ())
        gone = {one.value for one in (values["taken"] if operation == "other" else both)}
        known = [one.value for one in both] if operation == "other" else request.scene_colors
        left = [one for one in known if one not in gone]
        return left[0] if len(left) == 1 else None
    if operation in ("same", "seen", "place", "rank"):
        return values[pointer.of][0].value
    return _counted(operation, values)


def _counted(operation: str, values: Mapping[str, Sequence[IntroducedValue]]) -> int:
    number = int(values["reference"][0].value)
    step = int(values["step"][0].value) if "step" in values else 0
    return number + {
        "minus": -step, "earlier": -step, "plus": step, "later": step,
        "before": -1, "after": 1, "two before": -2, "two after": 2,
        "double": number, "half": number // 2 - number,
    }[operation]  # fmt: skip
