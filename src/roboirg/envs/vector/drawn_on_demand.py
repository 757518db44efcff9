"""What a vector environment returns without its pictures, which are drawn when they are read."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from typing import Any

from numpy.typing import NDArray

Draw = Callable[[str], NDArray[Any]]
"""Function that returns a field, given its name; raises InvalidValueError if it is too late."""


class LazyObservation(Mapping[str, Any]):
    """Observations whose pictures are drawn when they are first read, before the next step.

    Args:
        fields: the fields that are there.
        pictures: names of the fields that are drawn.
        draw: draws a field.
    """

    def __init__(self, fields: dict[str, Any], pictures: frozenset[str], draw: Draw) -> None:
        self._fields, self._pictures, self._draw = fields, pictures, draw

    def __getitem__(self, field: str) -> Any:  # noqa: ANN401 - arrays and tuples of texts
        """Return a field; raises InvalidValueError if it was not drawn in time."""
        if field in self._pictures and field not in self._fields:
            self._fields[field] = self._draw(field)
        return self._fields[field]

    def __iter__(self) -> Iterator[str]:
        yield from sorted(self._pictures)
        yield from (field for field in self._fields if field not in self._pictures)

    def __len__(self) -> int:
        return len(self._pictures | set(self._fields))
