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
        # What stands there and means nothing explains best what is missing.
        first = min(error.errors(), key=lambda one: one["type"] != "extra_forbidden")
        name = str(first["loc"][-1]) if first["loc"] else "options"
        if first["type"] == "extra_forbidden":
            raise UnknownNameError(f"option of {origin} named", name, _names(kind)) from None
        if first["type"] == "missing":
            raise InvalidValueError(f"{origin}: option {name} is missing.") from None
        message = plain_complaint(first["msg"])
        given = re.sub(r"//[^/@]*@", "//…@", repr(first["input"]))  # no password of a URL
        end = "" if message.endswith((".", "?")) else "."
        raise InvalidValueError(f"{origin}: option {name} is {given}; {message}{end}") from None


def flags_as_words(given: Any) -> Any:  # noqa: ANN401 - options, or the value of one
    """Return options with True and False as words, because numbers would take them as 1 and 0.

    Options that are flags take the words.
    """
    if isinstance(given, Mapping):
        return {name: flags_as_words(value) for name, value in given.items()}
    return str(given) if isinstance(given, bool | np.bool_) else given


def plain_complaint(message: str) -> str:
    """Return pydantic's complaint about a value in plain words, to stand behind the value."""
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
    """Return the names of all options, those in tables in place of the table."""
    names: list[str] = []
    for name, field in kind.model_fields.items():
        table = field.annotation
        is_table = isinstance(table, type) and issubclass(table, BaseModel)
        names += _names(table) if is_table else [name]  # type: ignore[arg-type]
    return names
