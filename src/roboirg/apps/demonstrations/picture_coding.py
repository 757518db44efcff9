"""Encode pictures: PNG, or H.264 with or without loss."""

from __future__ import annotations

import io
from fractions import Fraction
from typing import Any, Literal, NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from roboirg.core.observations import Pixels
from roboirg.util.media import CONTROL_RATE, Mp4Encoder

PictureCoding = Literal["png", "lossless-video", "lossy-video", "none"]

KEY_FRAMES = 10
"""Pictures from one that decodes alone to the next: half a second."""
LOSSY_QUALITY = 18
"""x264's constant rate factor."""
_PNG_OPTIONS = (
    cv2.IMWRITE_PNG_COMPRESSION,
    1,
    cv2.IMWRITE_PNG_STRATEGY,
    cv2.IMWRITE_PNG_STRATEGY_RLE,
)
"""Higher levels save 3 % and take three times as long; other strategies are slower and larger."""


class _Codec(NamedTuple):
    """How a video is encoded: by what, the pixels that go in, and the constant rate factor."""

    name: str
    pixels: str
    quality: int


_CODECS: dict[str, _Codec] = {
    "lossless-video": _Codec("libx264rgb", "rgb24", quality=0),
    "lossy-video": _Codec("libx264", "yuv420p", quality=LOSSY_QUALITY),
}
STORED_FORMATS = {"lossless-video": "gbrp", "lossy-video": "yuv420p"}
"""The pixel format that a stored video has."""


def encode_png(picture: Pixels) -> bytes:
    """Return a picture, RGB (height, width, 3), as PNG."""
    return _png(np.asarray(cv2.cvtColor(picture, cv2.COLOR_RGB2BGR)))


def encode_depth(depth: NDArray[np.int16]) -> bytes:
    """Return depth (height, width, 1), mm >= 0, as PNG of 16 bits."""
    return _png(depth[..., 0].astype(np.uint16))


def _png(image: NDArray[Any]) -> bytes:
    """Return a picture in OpenCV's order of channels as PNG."""
    _, content = cv2.imencode(".png", image, _PNG_OPTIONS)
    return content.tobytes()


class VideoEncoder(Mp4Encoder):
    """Encodes one video in memory: `add` each picture in order, then `finish` once.

    Args:
        coding: ``lossless-video`` or ``lossy-video``.
        size: width and height of the pictures, pixels; an even number.
    """

    def __init__(self, coding: PictureCoding, size: int) -> None:
        """Open a video in memory; the codec follows from `coding`."""
        codec = _CODECS[coding]
        options = {
            "crf": str(codec.quality),
            "g": str(KEY_FRAMES),
            "bf": "0",  # frames that depend on later ones
        }
        self._file = io.BytesIO()
        example = np.empty((size, size, 3), np.uint8)
        rate = Fraction(CONTROL_RATE)
        super().__init__(self._file, example, rate, options, codec.name, codec.pixels)

    def finish(self) -> bytes:
        """Return the video as MP4; no picture can be added after this."""
        self.close()
        return self._file.getvalue()


def count_values(picture: Pixels) -> NDArray[np.int64]:
    """Return how often each value occurs in each channel of a picture, (3, 256)."""
    counts = [cv2.calcHist([picture], [channel], None, [256], [0, 256]) for channel in range(3)]
    # A vector or a column, by OpenCV's version.
    return np.stack([np.ravel(of_channel) for of_channel in counts]).astype(np.int64)
