"""Check options from files and command lines; errors are one sentence."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Annotated, Any, TypeVar

import numpy as np
from pydantic import BaseModel, Field, ValidationError

from roboirg.core.errors import InvalidValueError, UnknownNameError
from roboirg.core.field_types import MOST_SECONDS

Options = TypeVar("Options", bound=BaseModel)
NOT_COMPARED = True
"""Excludes an option from what a policy is: with another value it is the same policy, as the option
only concerns the connection or the price, or is compared as the version."""
Seconds = Annotated[float, Field(le=MOST_SECONDS)]
"""A time limit in an option."""


def check_options(kind: type[Options], values: Mapping[str, Any], origin: str) -> Options:
    """Return checked options; texts are converted to numbers and booleans.

    Args:
        kind: model of the options.
        values: by name, tables nested.
        origin: of the values, for error messages.

    Raises:
        UnknownNameError: there is no such option; the message names the nearest.
        InvalidValueError: an option is missing or has an invalid value.
    """
    try:
        return kind.model_validate(flags_as_words(values))
    except ValidationError as error:
        raise _in_one_sentence(error, kind, origin) from None


def _in_one_sentence(
    error: ValidationError, kind: type[BaseModel], origin: str
) -> InvalidValueError | UnknownNameError:
    """Return (not raise) pydantic's faults as an error of one sentence.

    It is about the first unknown option, or without any about the first fault: ``Policy 'x': option
    port is 'a'; it must be a whole number.``

    Args:
        error: with all faults.
        kind: class of the options.
        origin: of the options, such as ``system GroundSG``.
    """
    faults = error.errors()
    unknown = [fault for fault in faults if fault["type"] == "extra_forbidden"]
    # An option that does not exist explains best why another one is missing.
    fault = unknown[0] if unknown else faults[0]
    name = str(fault["loc"][-1]) if fault["loc"] else "options"
    if unknown:
        return UnknownNameError(f"option of {origin} named", name, _names(kind))
    if fault["type"] == "missing":
        return InvalidValueError(f"{origin}: option {name} is missing.")
    # A URL may hold a password: "http://me:secret@host" is shown as "http://…@host".
    given = re.sub(r"//[^/@]*@", "//…@", repr(fault["input"]))
    complaint = plain_complaint(fault["msg"])
    if not complaint.endswith((".", "?")):
        complaint += "."
    return InvalidValueError(f"{origin}: option {name} is {given}; {complaint}")


def flags_as_words(given: Any) -> Any:  # noqa: ANN401 - options, or the value of one
    """Return options with True and False as words, because numbers would take them as 1 and 0.

    ``{"steps": True}`` -> ``{"steps": "True"}``, which a number refuses and a flag takes. Tables
    within tables are treated likewise.
    """
    if isinstance(given, Mapping):
        return {name: flags_as_words(value) for name, value in given.items()}
    return str(given) if isinstance(given, bool | np.bool_) else given


def plain_complaint(message: str) -> str:
    """Return pydantic's complaint about a value in plain words, to stand behind the value.

    ``Input should be a valid integer, unable to parse string`` -> ``it must be a whole number``.
    The order of the replacements matters: ``valid `` alone goes last.
    """
    return (
        re.sub("^Value error, |, (unable|got) .*| or an instance of .*", "", message)
        .replace("Input should", "it must")
        .replace("String should", "it must")
        .replace("greater than or equal to", "at least")
        .replace("less than or equal to", "at most")
        .replace("valid integer", "whole number")
        .replace("valid tuple", "list")
        .replace("valid ", "")
    )


def _names(kind: type[BaseModel]) -> list[str]:
    """Return the names of all options, for suggestions.

    A field that is a model itself is a table of options; its options are listed instead.
    """
    names = []
    for name, field in kind.model_fields.items():
        table = field.annotation
        if isinstance(table, type) and issubclass(table, BaseModel):
            names += _names(table)
        else:
            names.append(name)
    return names
