"""Make plans from options, whose values are as typed, as in YAML, or Python's."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import Any

from pydantic import TypeAdapter, ValidationError

from roboirg.core.errors import InvalidValueError
from roboirg.core.instruction_options import InstructionOptions
from roboirg.core.policy_ref import PolicyRef
from roboirg.policies.contract.option_checking import plain_complaint
from roboirg.runs.plan.plan import Plan
from roboirg.runs.plan.plan_fields import FLAT


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
    """Return options of instructions that are typed as in a plan, with one value each.

    A wording file among them is opened, and named by the hash of its content.

    Raises:
        InvalidValueError: a value is out of range, or there are several sets of stages.
    """
    plan = _unchecked(policies="oracle", **options)
    if len(plan.stages) > 1:
        given = options["stages"]
        raise InvalidValueError(f"stages is {given!r}; here it must be one set, such as 1,5.")
    wordings = plan.wordings and plan.wordings.identity
    return replace(plan.instruction, stages=plan.stages[0], wordings=wordings)


def as_typed_field(name: str, kind: Any, value: object) -> Any:  # noqa: ANN401 - of that type
    """Return a value from a file as a field of a type.

    Raises:
        InvalidValueError: it cannot be one.
    """
    try:
        return TypeAdapter(kind).validate_python(value)
    except ValidationError as error:
        raise _refusal(name, value, error.errors()[0]["msg"]) from error


def _unchecked(**options: object) -> Plan:
    """Return a plan whose values have the right types; whether it can be played is not checked.

    Raises:
        InvalidValueError: a value has a wrong type; the message is one plain sentence.
    """
    try:
        return Plan.model_validate(options)
    except ValidationError as error:
        fault = error.errors()[0]
        # If one of our validators raised the error, its message is better than pydantic's.
        cause = fault.get("ctx", {}).get("error")
        if isinstance(cause, InvalidValueError):
            raise cause from error
        name = _typed_name([str(part) for part in fault["loc"]])
        raise _refusal(name, fault["input"], fault["msg"]) from error


def _typed_name(path: Sequence[str]) -> str:
    """Return the name of an option as a user types it, given its path in the plan.

    An option that may stand alone is named without its section: ``["environment", "max_steps"]``
    is ``max_steps``; ``["cluster", "cpus"]`` is ``cluster.cpus``.
    """
    if len(path) > 1 and path[1] in FLAT:
        return path[1]
    return ".".join(path)


def _refusal(name: str, value: object, message: str) -> InvalidValueError:
    """Return pydantic's complaint about a value in one plain sentence."""
    return InvalidValueError(f"{name} is {value!r}; {plain_complaint(message)}.")
