"""Statistics of features, against NumPy on all values."""

import numpy as np
import pytest

from roboirg.apps.demonstrations.feature_stats import QUANTILES, picture_stats
from roboirg.apps.demonstrations.picture_coding import count_values


@pytest.mark.parametrize("colors", [1, 2, 6])
def test_statistics_of_pictures_are_numpys_of_all_their_pixels(colors):
    """Two pictures of few colors; NumPy computes the same from all pixels, scaled to 0 to 1.

    Pixels are counted by value, from which the statistics follow. Shapes are LeRobot's: (3, 1, 1),
    and `count` is that of pictures.
    """
    rng = np.random.default_rng(colors)
    palette = rng.integers(0, 256, (colors, 3), dtype=np.uint8)
    pictures = palette[rng.integers(0, colors, (2, 256, 256))]
    pixels = pictures.reshape(-1, 3) / 255.0

    stats = picture_stats(sum(count_values(picture) for picture in pictures), 256 * 256)

    assert np.ravel(stats["min"]) == pytest.approx(pixels.min(axis=0))
    assert np.ravel(stats["max"]) == pytest.approx(pixels.max(axis=0))
    assert np.ravel(stats["mean"]) == pytest.approx(pixels.mean(axis=0))
    assert np.ravel(stats["std"]) == pytest.approx(pixels.std(axis=0), abs=1e-9)
    for name, share in QUANTILES.items():
        assert np.ravel(stats[name]) == pytest.approx(np.quantile(pixels, share, axis=0)), name
    assert np.shape(stats["mean"]) == (3, 1, 1)
    assert stats["count"] == [2]


@pytest.mark.parametrize(("more", "median"), [(0, 15), (1, 20)])
def test_one_pixel_more_moves_the_median(more, median):
    """Half of the pixels has the value 10, the other half 20: the median is 15, between them.

    With one more of value 20 the median is 20. Statistics are of values from 0 to 1, so divided by
    255.
    """
    counts = np.zeros((3, 256), np.int64)
    counts[:, 10] = 96 * 96 // 2
    counts[:, 20] = 96 * 96 // 2 + more

    stats = picture_stats(counts, 96 * 96)

    assert np.ravel(stats["q50"]) == pytest.approx([median / 255] * 3)
