"""What a vector environment returns without its pictures, which are drawn when they are read."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from typing import Any

from numpy.typing import NDArray

from roboirg.envs.vector.vector_workers import VideoFields

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


class WorkerVideo(Mapping[str, NDArray[Any]]):
    """The demonstration of a sub-environment; pictures are drawn by its worker when read.

    They can be read until the sub-environment starts its next episode; what was read stays.

    Args:
        video: what is known of it.
        draw: returns another field.

    Attributes:
        length: control steps in the video, T.
    """

    def __init__(self, video: VideoFields, draw: Draw) -> None:
        self.length = video.length
        self._fields, self._arrays, self._draw = video.fields, dict(video.arrays), draw

    def __getitem__(self, field: str) -> NDArray[Any]:
        """Return a field for all steps; raises KeyError if it does not exist."""
        if field in self._fields and field not in self._arrays:
            self._arrays[field] = self._draw(field)
        return self._arrays[field]

    def __contains__(self, field: object) -> bool:
        return field in self._fields

    def __iter__(self) -> Iterator[str]:
        return iter(self._fields)

    def __len__(self) -> int:
        return len(self._fields)
