"""Scenes and goals as JSON values and back; fields with their default value are left out."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Mapping

from roboirg.core.conditions import Fact
from roboirg.core.episode import Goal, Scene, SceneObject
from roboirg.core.motions import Away, Glow, Point, Shuttle, Swap, Vanish

Json = str | int | float | bool | None | list["Json"] | dict[str, "Json"]

_TYPES: Mapping[str, type] = {
    one.__name__: one
    for one in (Scene, SceneObject, Goal, Fact, Point, Away, Swap, Shuttle, Glow, Vanish)
}
_TYPE = "type"
DECIMALS = 7
"""The data is given to 1e-7 m and rad."""


def encode(value: object) -> Json:
    """Return a scene, a goal or a part of one as JSON values."""
    if type(value) is float:
        return round(value, DECIMALS) + 0.0
    if value is None or isinstance(value, str | int):
        return value
    if type(value).__name__ in _TYPES:
        given = {name: encode(one) for name, one, default in fields_of(value) if one != default}
        return {_TYPE: type(value).__name__, **given}
    if isinstance(value, tuple):
        return [encode(one) for one in value]
    raise TypeError(f"{value!r} of {type(value).__name__} is no part of a scene")


def decode(value: Json) -> object:
    """Return what `encode` was given, floats rounded."""
    if isinstance(value, dict):
        fields = {name: decode(one) for name, one in value.items() if name != _TYPE}
        return _TYPES[str(value[_TYPE])](**fields)
    if isinstance(value, list):
        return tuple(decode(one) for one in value)
    return value


def fields_of(value: object) -> Iterator[tuple[str, object, object]]:
    """Yield name, value and default of each field; `MISSING` where there is no default."""
    if dataclasses.is_dataclass(value):
        for field in dataclasses.fields(value):
            yield field.name, getattr(value, field.name), field.default
    else:
        defaults: Mapping[str, object] = getattr(value, "_field_defaults", {})
        for name in getattr(value, "_fields", ()):
            yield name, getattr(value, name), defaults.get(name, dataclasses.MISSING)
