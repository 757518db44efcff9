"""Draws from a generator that is passed in."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TypeVar

import numpy as np

Item = TypeVar("Item")


def draw(rng: np.random.Generator, options: Sequence[Item]) -> Item:
    """Draw one of some options, all equally likely."""
    return options[int(rng.integers(len(options)))]


def shuffled(rng: np.random.Generator, items: Sequence[Item]) -> list[Item]:
    """Return the items in random order, all orders equally likely."""
    return [items[index] for index in rng.permutation(len(items))]
