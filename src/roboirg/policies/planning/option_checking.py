"""Options from files and command lines, checked; complaints in one sentence."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any, TypeVar

from pydantic import BaseModel, ValidationError

from roboirg.core.errors import InvalidValueError, UnknownNameError

Options = TypeVar("Options", bound=BaseModel)


def check_options(kind: type[Options], values: Mapping[str, Any], origin: str) -> Options:
    """Options of a kind. Texts stand for the numbers and truth values that they spell.

    Args:
        kind: which options there are.
        values: by name, tables nested.
        origin: where they are from, for complaints.

    Raises:
        UnknownNameError: there is no such option; names the nearest.
        InvalidValueError: an option is missing or has a value that it cannot have.
    """
    try:
        return kind.model_validate(dict(values))
    except ValidationError as error:
        first = error.errors()[0]
        path = [str(part) for part in first["loc"]]
        name = ".".join(path) or "options"
        if first["type"] == "extra_forbidden":
            raise UnknownNameError(f"option of {origin}", name, _names(kind)) from None
        if first["type"] == "missing":
            raise InvalidValueError(f"{origin}: option {name} is missing.") from None
        message = first["msg"].removeprefix("Value error, ")
        end = "" if message.endswith((".", "?")) else "."
        raise InvalidValueError(
            f"{origin}: option {name} is {_shown(first['input'])}: {message}{end}"
        ) from None


def _shown(value: object) -> str:
    """A value as it is quoted, without the password of a URL."""
    return re.sub(r"//[^/@]*@", "//…@", repr(value))


def _names(kind: type[BaseModel], before: str = "") -> list[str]:
    """All options, those of tables with dots."""
    names: list[str] = []
    for name, field in kind.model_fields.items():
        held = field.annotation
        if isinstance(held, type) and issubclass(held, BaseModel):
            names += _names(held, f"{before}{name}.")
        else:
            names.append(f"{before}{name}")
    return names
