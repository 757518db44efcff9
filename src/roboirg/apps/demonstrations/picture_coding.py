"""Encode pictures: PNG, or H.264 without loss or with a loss that is measured."""

from __future__ import annotations

import io
import math
from collections import deque
from fractions import Fraction
from typing import Any, Literal

import cv2
import numpy as np
from numpy.typing import NDArray

from roboirg.core.errors import RoboIRGError
from roboirg.util.media import CONTROL_RATE, Pixels

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
_CODECS: dict[str, tuple[str, str, dict[str, str]]] = {
    "lossless-video": ("libx264rgb", "rgb24", {"crf": "0"}),
    "lossy-video": ("libx264", "yuv420p", {"crf": str(LOSSY_QUALITY)}),
}
STORED_FORMATS = {"lossless-video": "gbrp", "lossy-video": "yuv420p"}
"""The pixel format that a stored video has."""
_MAX_VALUE = 255.0


def encode_png(picture: Pixels) -> bytes:
    """Return a picture, RGB (height, width, 3), as PNG."""
    return _png(np.asarray(cv2.cvtColor(picture, cv2.COLOR_RGB2BGR)))


def encode_depth(depth: NDArray[np.int16]) -> bytes:
    """Return depth (height, width, 1), mm >= 0, as PNG of 16 bits."""
    return _png(depth[..., 0].astype(np.uint16))


def _png(image: NDArray[Any]) -> bytes:
    _, content = cv2.imencode(".png", image, _PNG_OPTIONS)
    return content.tobytes()


class VideoEncoder:
    """Encodes one video in memory, and decodes every picture again to measure the loss.

    Args:
        coding: ``lossless-video`` or ``lossy-video``.
    """

    def __init__(self, coding: PictureCoding) -> None:
        import av

        codec, pixels, quality = _CODECS[coding]
        self._coding, self._file = coding, io.BytesIO()
        self._container = av.open(self._file, "w", format="mp4")
        stream: Any = self._container.add_stream(codec, rate=Fraction(CONTROL_RATE))
        stream.pix_fmt = pixels
        stream.options = {**quality, "preset": "veryfast", "g": str(KEY_FRAMES), "bf": "0"}
        stream.codec_context.thread_count = 1
        self._stream = stream
        self._decoder: Any = None
        self._waiting: deque[Pixels] = deque()
        self._loss = _PictureLoss()

    def add(self, picture: Pixels) -> None:
        """Encode a picture, RGB (height, width, 3); all have the same, even size."""
        import av

        if self._decoder is None:
            self._stream.height, self._stream.width = picture.shape[:2]
        self._waiting.append(picture)
        frame = av.VideoFrame.from_ndarray(picture, format="rgb24")
        self._take(self._stream.encode(frame))

    def finish(self) -> bytes:
        """Return the video as MP4.

        Raises:
            RoboIRGError: a lossless video does not decode to the same pictures.
        """
        self._take(self._stream.encode(None))
        self._compare(self._decoder.decode(None))
        self._container.close()
        if self._waiting or (self._coding == "lossless-video" and self._loss.largest):
            raise RoboIRGError(
                "The lossless video does not decode to the same pictures; this build of FFmpeg "
                "cannot be used for it. Ask for --pictures png."
            )
        return self._file.getvalue()

    @property
    def error(self) -> dict[str, float]:
        """The loss so far: mean absolute and largest error (of 255), and PSNR (dB)."""
        return self._loss.as_dict()

    def _take(self, packets: list[Any]) -> None:
        """Store packets, and compare the pictures that they decode to with the originals."""
        import av

        if self._decoder is None:
            self._decoder = av.CodecContext.create("h264", "r")
            self._decoder.extradata = self._stream.codec_context.extradata
        for packet in packets:
            self._compare(self._decoder.decode(packet))
            self._container.mux(packet)

    def _compare(self, frames: list[Any]) -> None:
        for frame in frames:
            self._loss.add(self._waiting.popleft(), frame.to_ndarray(format="rgb24"))


class _PictureLoss:
    """Sums up the errors of decoded pictures.

    Attributes:
        largest: error so far, of 255.
    """

    def __init__(self) -> None:
        self.largest = 0
        self._absolute = self._squared = self._count = 0

    def add(self, original: Pixels, decoded: Pixels) -> None:
        difference = np.abs(original.astype(np.int32) - decoded)
        self.largest = max(self.largest, int(difference.max()))
        self._absolute += int(difference.sum())
        self._squared += int((difference * difference).sum())
        self._count += difference.size

    def as_dict(self) -> dict[str, float]:
        mean_square = self._squared / max(self._count, 1)
        psnr = 10.0 * math.log10(_MAX_VALUE**2 / mean_square) if mean_square else math.inf
        return {
            "mean": self._absolute / max(self._count, 1),
            "largest": float(self.largest),
            "psnr": psnr,
        }


def count_values(picture: Pixels) -> NDArray[np.int64]:
    """Return how often each value occurs in each channel of a picture, (3, 256)."""
    found = [cv2.calcHist([picture], [one], None, [256], [0, 256]) for one in range(3)]
    # A vector or a column, by OpenCV's version.
    return np.stack([np.ravel(one) for one in found]).astype(np.int64)
