"""Scenes and goals as JSON values and back; fields with their default value are left out."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Mapping
from typing import NamedTuple

from roboirg.core.conditions import Fact
from roboirg.core.episode import Goal, Scene, SceneObject
from roboirg.core.motions import Away, Glow, Point, Shuttle, Swap, Vanish

Json = str | int | float | bool | None | list["Json"] | dict[str, "Json"]

_CODED = (Scene, SceneObject, Goal, Fact, Point, Away, Swap, Shuttle, Glow, Vanish)
_TYPES: Mapping[str, type] = {kind.__name__: kind for kind in _CODED}
_TYPE = "type"
"""The key under which a JSON object names its type."""
DECIMALS = 7
"""The data is given to 1e-7 m and rad."""


class FieldValue(NamedTuple):
    """A field of a dataclass or named tuple.

    Attributes:
        name: of the field.
        value: what it holds.
        default: what it holds if nothing is given; `dataclasses.MISSING` if something must be.
    """

    name: str
    value: object
    default: object


def encode(value: object) -> Json:
    """Return a scene, a goal or a part of one as JSON values; `decode` is the way back.

    ``Point(0.1, 0.0, 0.02)`` -> ``{"type": "Point", "x": 0.1, "y": 0.0, "z": 0.02}``. Fields with
    their default value are left out. The order of the cases matters: a named tuple such as `Point`
    is a tuple, too.
    """
    if type(value) is float:
        return round(value, DECIMALS) + 0.0  # which makes 0 of -0
    if value is None or isinstance(value, str | int):
        return value
    if type(value).__name__ in _TYPES:
        row: dict[str, Json] = {_TYPE: type(value).__name__}
        for field in fields_of(value):
            if field.value != field.default:
                row[field.name] = encode(field.value)
        return row
    if isinstance(value, tuple):
        return [encode(item) for item in value]
    raise TypeError(f"{value!r} of {type(value).__name__} is no part of a scene")


def decode(value: Json) -> object:
    """Return what `encode` was given, floats rounded to `DECIMALS`; lists become tuples."""
    if isinstance(value, dict):
        fields = {name: decode(field) for name, field in value.items() if name != _TYPE}
        return _TYPES[str(value[_TYPE])](**fields)
    if isinstance(value, list):
        return tuple(decode(item) for item in value)
    return value


def fields_of(value: object) -> Iterator[FieldValue]:
    """Yield the fields of a dataclass or named tuple in their order; nothing for other values."""
    if dataclasses.is_dataclass(value):
        for field in dataclasses.fields(value):
            yield FieldValue(field.name, getattr(value, field.name), field.default)
    else:
        defaults: Mapping[str, object] = getattr(value, "_field_defaults", {})
        for name in getattr(value, "_fields", ()):
            default = defaults.get(name, dataclasses.MISSING)
            yield FieldValue(name, getattr(value, name), default)
