"""Make plans from options, whose values are as typed, as in YAML, or Python's."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from typing import Any

from pydantic import TypeAdapter, ValidationError

from roboirg.core.errors import InvalidValueError
from roboirg.core.instruction_options import InstructionOptions
from roboirg.core.policy_ref import PolicyRef
from roboirg.evaluation.plan.plan import SECTIONS, Plan


def make_plan(policies: str | Iterable[str | PolicyRef], **options: object) -> Plan:
    """Return a checked plan.

    Args:
        policies: names or addresses; names may be separated by commas.
        **options: other fields of `Plan`; the options of its sections also by their own names.

    Raises:
        UnknownNameError: a name does not exist; the message suggests the nearest.
        InvalidValueError: a number or combination is out of range.
    """
    return _unchecked(policies=policies, **options).checked()


def word_options(**options: object) -> InstructionOptions:
    """Return options of instructions as in a plan, one value each; opens the wording file.

    Raises:
        InvalidValueError: a value is out of range, or there are several sets of stages.
    """
    plan = _unchecked(policies="oracle", **options)
    if len(plan.stages) > 1:
        given = options["stages"]
        raise InvalidValueError(f"stages is {given!r}; here it must be one set, such as 1,5.")
    identity = None if plan.wordings is None else plan.wordings.identity
    return replace(plan.instruction, stages=plan.stages[0], wordings=identity)


def as_typed_field(name: str, kind: Any, value: object) -> Any:  # noqa: ANN401 - of that type
    """Return a value from a file as a field of a type.

    Raises:
        InvalidValueError: it cannot be one.
    """
    try:
        return TypeAdapter(kind).validate_python(value)
    except ValidationError as error:
        raise InvalidValueError(f"{name} is {value!r}: {error.errors()[0]['msg']}.") from error


def _unchecked(**options: object) -> Plan:
    try:
        return Plan.model_validate(options)
    except ValidationError as error:
        first = error.errors()[0]
        cause = first.get("ctx", {}).get("error")
        if isinstance(cause, InvalidValueError):
            raise cause from error
        section, *inner = map(str, first["loc"])
        is_inside = section in SECTIONS and inner
        name = ".".join(inner[:1] if is_inside and section != "cluster" else [section, *inner])
        raise InvalidValueError(f"{name} is {first['input']!r}: {first['msg']}.") from error
