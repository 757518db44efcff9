"""Statistics of features, against NumPy on all values."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from roboirg.apps.demonstrations.feature_stats import QUANTILES, picture_stats
from roboirg.apps.demonstrations.picture_coding import count_values


@settings(max_examples=8)
@given(st.integers(1, 3), st.integers(1, 6), st.integers(0, 2**32 - 1))
def test_pictures_agree_with_numpy_on_all_pixels(count, colors, seed):
    rng = np.random.default_rng(seed)
    palette = rng.integers(0, 256, (colors, 3), dtype=np.uint8)
    pictures = palette[rng.integers(0, colors, (count, 256, 256))]
    stats = picture_stats(sum(count_values(picture) for picture in pictures), 256 * 256)

    pixels = pictures.reshape(-1, 3) / 255.0

    for name, expected in {
        "min": pixels.min(axis=0),
        "max": pixels.max(axis=0),
        "mean": pixels.mean(axis=0),
        "std": pixels.std(axis=0),
        **{name: np.quantile(pixels, share, axis=0) for name, share in QUANTILES.items()},
    }.items():
        assert np.shape(stats[name]) == (3, 1, 1)
        assert np.ravel(stats[name]) == pytest.approx(expected, abs=1e-9)
    assert stats["count"] == [count]


def test_one_pixel_more_or_less_moves_the_median():
    counts = np.zeros((3, 256), np.int64)
    counts[:, 10] = counts[:, 20] = 96 * 96 // 2
    assert np.ravel(picture_stats(counts, 96 * 96)["q50"]) == pytest.approx([15 / 255] * 3)

    counts[0, 20] += 1
    assert np.ravel(picture_stats(counts, 96 * 96)["q50"])[0] == pytest.approx(20 / 255)
