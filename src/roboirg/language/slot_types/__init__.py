"""The kinds of values that a goal can hold, and how each is spoken of.

The order is the order of speaking: colors come last, so that ``it`` in the command follows the
sentence about its cube.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

from roboirg.language.phrases import Phrase
from roboirg.language.request import Part, PartKind, Request
from roboirg.language.slot_types import amount, color, number, ordinal, relation
from roboirg.language.slot_types.slot_type import Fields, Kind

__all__ = ["KINDS", "Fields", "Kind", "described", "kinds_in"]

KINDS: Mapping[PartKind, Kind] = {
    kind.name: kind
    for kind in (
        number.KIND,
        ordinal.VISIT,
        ordinal.PLACEMENT,
        relation.KIND,
        color.KIND,
        amount.KIND,
    )
}


def kinds_in(request: Request) -> Iterator[tuple[Kind, tuple[Part, ...]]]:
    """The kinds that the goal has values of, in the order of speaking, with these values."""
    for name, kind in KINDS.items():
        parts = request.parts_of(name)
        if parts:
            yield kind, parts


def described(request: Request, things: Sequence[Phrase]) -> Fields:
    """The fields of the command for the goal's colors, given a description for each of them."""
    fields: Fields = {}
    for kind, parts in kinds_in(request):
        if kind.described is not None:
            fields |= kind.described(parts, things)
    return fields
