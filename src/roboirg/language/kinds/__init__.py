"""The kinds of values that a goal can hold, one file each, and how each is spoken of.

The order is the order of speaking: numbers come before colours, so that ``it`` in the command
follows the sentence about its cube.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from roboirg.language.kinds import colour, number
from roboirg.language.kinds.kind import Kind
from roboirg.language.request import Part, PartKind, Request

__all__ = ["KINDS", "Kind", "kinds_in"]

KINDS: Mapping[PartKind, Kind] = {"number": number.KIND, "colour": colour.KIND}


def kinds_in(request: Request) -> Iterator[tuple[Kind, tuple[Part, ...]]]:
    """The kinds that the goal has values of, in the order of speaking, with these values."""
    for name, kind in KINDS.items():
        parts = request.parts_of(name)
        if parts:
            yield kind, parts
