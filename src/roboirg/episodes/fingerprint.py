"""A number that changes whenever an episode does: SHA-256 over its plain data."""

from __future__ import annotations

import dataclasses
import hashlib
import json
from collections.abc import Iterable

from roboirg.core.episode import Episode

Plain = str | int | float | bool | None | list["Plain"] | dict[str, "Plain"]
"""What JSON can hold."""

DECIMALS = 9

NOT_COUNTED = frozenset({("Rule", "cause"), ("Rule", "failure")})
"""Type and name of fields that describe a failure and change no score: two episodes that differ
in nothing else are the same."""


def fingerprint(episodes: Iterable[Episode]) -> str:
    """SHA-256, in hexadecimal, over the canonical JSON of whole episodes, in their order.

    Floats count to nine decimals: the last bits of a sine differ between mathematics libraries.
    """
    digest = hashlib.sha256()
    for episode in episodes:
        text = json.dumps(plain(episode), sort_keys=True, separators=(",", ":"), allow_nan=False)
        digest.update(text.encode() + b"\n")
    return digest.hexdigest()


def plain(value: object) -> Plain:
    """Dataclasses and named tuples, to any depth, as what JSON can hold; each says its type.

    Raises:
        TypeError: there is something in it that is no plain data, such as a NumPy number.
    """
    if type(value) is float:
        return round(value, DECIMALS)
    if value is None or type(value) in {str, int, bool}:
        return value  # type: ignore[return-value] # mypy does not narrow by `in`
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        names = tuple(field.name for field in dataclasses.fields(value))
    elif isinstance(value, tuple):
        names = getattr(value, "_fields", ())
        if not names:
            return [plain(item) for item in value]
    else:
        raise TypeError(f"{value!r} of {type(value).__name__} is no plain data")
    kind = type(value).__name__
    counted = (name for name in names if (kind, name) not in NOT_COUNTED)
    return {"type": kind, **{name: plain(getattr(value, name)) for name in counted}}
