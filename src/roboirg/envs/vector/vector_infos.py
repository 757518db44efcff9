"""The infos of sub-environments as arrays of a fixed shape."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray


def stack_infos(infos: Sequence[Mapping[str, Any] | None]) -> dict[str, Any]:
    """Return an array (n,) for each key of n infos, and under ``_key`` who has it.

    Texts become arrays of Unicode, where None is empty; flags and numbers keep their type; maps
    become maps of arrays, and everything else arrays of objects.

    Args:
        infos: of the sub-environments, in their order; None for those without one.
    """
    stacked: dict[str, Any] = {}
    for key in dict.fromkeys(key for info in infos if info is not None for key in info):
        there = np.array([info is not None and key in info for info in infos])
        values = [info[key] if info is not None and key in info else None for info in infos]
        stacked[key] = _stack(values)
        stacked[f"_{key}"] = there
    return stacked


def _stack(values: Sequence[Any]) -> NDArray[Any] | dict[str, Any]:
    present = [value for value in values if value is not None]
    if present and all(type(value) is dict for value in present):
        return stack_infos(values)
    # Of our infos only texts may be None in all of them.
    for kind in (str, bool, int, float):
        if all(type(value) is kind for value in present):
            return np.array([kind() if value is None else value for value in values])
    stacked = np.empty(len(values), dtype=object)
    for index, value in enumerate(values):
        stacked[index] = value
    return stacked
