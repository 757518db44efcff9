"""Fingerprint: a SHA-256 hash that changes whenever an episode changes."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterable

from roboirg.core.episode import Episode
from roboirg.tasks.splits.scene_codec import fields_of

Plain = str | int | float | bool | None | list["Plain"] | dict[str, "Plain"]
"""Data that JSON can hold."""

PLAIN_TYPES = (str, int, bool, type(None))
"""Types whose values stay as they are."""
DECIMALS = 9

NOT_COUNTED = frozenset({("Rule", "cause"), ("Rule", "failure")})
"""Type and name of fields that describe a failure and change no score: two episodes that differ
in nothing else are the same."""

HASHED_AS = {("Stage", "in_video"): "recorded"}
"""Names of fields when the hashes of the shipped episodes were made, where they were others."""


def fingerprint(episodes: Iterable[Episode]) -> str:
    """Return the SHA-256 hash, in hexadecimal, of the canonical JSON of episodes, in their order.

    Floats are rounded to nine decimals: the last bits of a sine differ between math libraries.
    """
    digest = hashlib.sha256()
    for episode in episodes:
        text = json.dumps(plain(episode), sort_keys=True, separators=(",", ":"), allow_nan=False)
        digest.update(text.encode() + b"\n")
    return digest.hexdigest()


def plain(value: object) -> Plain:
    """Convert nested dataclasses and named tuples to data for JSON, with their type names.

    ``Fact("pressed", "button")`` -> ``{"type": "Fact", "kind": "pressed", "subject": "button",
    "place": None}``. Any change of what this returns changes every hash in ``splits.json``. Named
    tuples must come before tuples: they are tuples, too.
    """
    if type(value) is float:
        return round(value, DECIMALS)
    if type(value) in PLAIN_TYPES:
        return value  # type: ignore[return-value] # mypy does not narrow by `in`
    kind = type(value).__name__
    row = {}
    for field in fields_of(value):
        if (kind, field.name) not in NOT_COUNTED:
            name = HASHED_AS.get((kind, field.name), field.name)
            row[name] = plain(field.value)
    if row:
        return {"type": kind, **row}
    if isinstance(value, tuple):
        return [plain(item) for item in value]
    raise TypeError(f"{value!r} of {kind} is not plain data")
