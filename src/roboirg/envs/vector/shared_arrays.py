"""Arrays of all sub-environments in memory that their processes share."""

from __future__ import annotations

import ctypes
from collections.abc import Iterable, Mapping
from multiprocessing.context import BaseContext
from typing import Any, NamedTuple

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

_ALIGNMENT = 64


class _Place(NamedTuple):
    """Where an array is: its shape with a leading axis of sub-environments, type and offset."""

    shape: tuple[int, ...]
    dtype: str
    offset: int


class SharedArrays:
    """One array (n, ...) for each field of an observation that is a `Box`.

    Can be sent to a child process when it is started.

    Args:
        space: of one observation.
        count: number of sub-environments, n.
        context: how the processes are started.
    """

    def __init__(self, space: spaces.Dict, count: int, context: BaseContext) -> None:
        self._places: dict[str, _Place] = {}
        size = 0
        for field, box in space.items():
            if isinstance(box, spaces.Box):
                shape = (count, *box.shape)
                self._places[field] = _Place(shape, box.dtype.str, size)
                size += -(-int(np.prod(shape)) * box.dtype.itemsize // _ALIGNMENT) * _ALIGNMENT
        self._block = context.RawArray(ctypes.c_uint8, size)

    def open(self) -> Mapping[str, NDArray[Any]]:
        """Return the arrays as views of the shared memory."""
        block = memoryview(self._block).cast("B")
        return {
            field: np.ndarray(place.shape, place.dtype, block, place.offset)
            for field, place in self._places.items()
        }


def picture_fields(fields: Iterable[str]) -> frozenset[str]:
    """Return the fields of an observation that are drawn."""
    return frozenset(field for field in fields if field.endswith(("_rgb", "_depth")))
