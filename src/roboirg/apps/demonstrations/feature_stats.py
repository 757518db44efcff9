"""Statistics of a dataset's features, as LeRobot stores them, computed in one pass."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

QUANTILES: Mapping[str, float] = {"q01": 0.01, "q10": 0.1, "q50": 0.5, "q90": 0.9, "q99": 0.99}
_MAX_VALUE = 255.0

FeatureStats = dict[str, list[Any]]
"""Nested lists by statistic: min, max, mean, std, count and the quantiles."""


def vector_stats(values: NDArray[Any]) -> FeatureStats:
    """Return minimum, maximum, mean, deviation and quantiles of each number of a feature.

    Args:
        values: of the feature in each frame, such as joint angles, shape (frames, size); at least
            one frame.

    Returns:
        By the statistic's name a list of `size` numbers; `count`, a list with the number of frames.
    """
    numbers = values.astype(np.float64)
    stats: FeatureStats = {
        "min": numbers.min(axis=0).tolist(),
        "max": numbers.max(axis=0).tolist(),
        "mean": numbers.mean(axis=0).tolist(),
        "std": numbers.std(axis=0).tolist(),
    }
    quantiles = np.quantile(numbers, list(QUANTILES.values()), axis=0)
    for name, quantile in zip(QUANTILES, quantiles, strict=True):
        stats[name] = quantile.tolist()
    stats["count"] = [len(numbers)]
    return stats


def picture_stats(counts: NDArray[np.int64], pixels: int) -> FeatureStats:
    """Return the statistics of all pixels of a camera, exactly, from the counts of their values.

    Args:
        counts: (3, 256) how often each value occurs in each channel, over all pictures.
        pixels: of one picture, height times width.

    Returns:
        By name (min, max, mean, std, q01, …) nested lists of shape (3, 1, 1), as LeRobot has them,
            in 0 to 1; and `count`, a list with the number of pictures.
    """
    channels = [_channel_stats(channel) for channel in counts]
    stats: FeatureStats = {
        name: [[[channel[name] / _MAX_VALUE]] for channel in channels] for name in channels[0]
    }
    return stats | {"count": [int(counts[0].sum()) // pixels]}


def _channel_stats(counts: NDArray[np.int64]) -> dict[str, float]:
    """Return the statistics of one color channel from how often each of its values occurs.

    Args:
        counts: of the values 0, 1, 2, … of all pixels, shape (256,).
    """
    values = np.arange(len(counts), dtype=np.float64)
    total = int(counts.sum())
    mean = float(counts @ values) / total
    variance = float(counts @ (values - mean) ** 2) / total
    present = np.flatnonzero(counts)
    return {
        "min": float(present[0]),
        "max": float(present[-1]),
        "mean": mean,
        "std": variance**0.5,
        **{name: _quantile(counts, share) for name, share in QUANTILES.items()},
    }


def _quantile(counts: NDArray[np.int64], share: float) -> float:
    """Return the quantile of values from how often each occurs, as NumPy does from the values.

    Counts ``[2, 0, 2]`` are the values 0, 0, 2, 2; share 0.5 -> 1.0, between the second and third.

    Args:
        counts: of the values 0, 1, 2, …
        share: of the values that are smaller, 0 to 1.
    """
    cumulative = np.cumsum(counts)
    last = int(cumulative[-1]) - 1
    place = last * share  # in the sorted values, from 0; interpolated between two of them
    below = int(np.floor(place))
    above = min(below + 1, last)
    # The value at a place is the first that, with all smaller ones, occurs more often than that.
    low, high = np.searchsorted(cumulative, [below, above], side="right")
    return float(low + (place - below) * (high - low))
