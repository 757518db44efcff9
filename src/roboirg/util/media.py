"""Pictures and clips, and their encoding as PNG, JPEG and MP4 files."""

from __future__ import annotations

import functools
import io
from dataclasses import dataclass
from fractions import Fraction
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from roboirg.core.extras import extra_needed

Pixels = NDArray[np.uint8]

VIDEO_RATE = 30
"""Frames per second at which MME-VLA's planners show control steps (20 per second of the world)."""
CONTROL_RATE = 20
"""Control steps per second: videos run as fast as the world."""
QUALITY = 23
"""x264's constant rate factor, its default."""
JPEG_QUALITY = 90


class Picture(NamedTuple):
    """One picture.

    Attributes:
        pixels: uint8 (height, width, 3), RGB.
    """

    pixels: Pixels


@dataclass(frozen=True, eq=False)
class Clip:
    """A short video.

    Attributes:
        frames: uint8 (T, height, width, 3), T >= 1; height and width are even.
        rate: frames per second.
    """

    frames: Pixels
    rate: Fraction = Fraction(VIDEO_RATE)

    @functools.cached_property
    def file(self) -> bytes:
        """The clip as MP4, encoded once: a conversation repeats its clips."""
        return encode_mp4(self)


def sample_evenly(frames: Pixels, most: int) -> Pixels:
    """Return at most `most` frames, evenly spaced, including the first and the last."""
    if len(frames) <= most:
        return frames
    kept: Pixels = frames[np.linspace(0, len(frames) - 1, most).round().astype(int)]
    return kept


def encode_png(picture: Picture) -> bytes:
    """Return a picture as a PNG file."""
    _check_pyav()
    import av

    height, width = picture.pixels.shape[:2]
    codec = av.CodecContext.create("png", "w")
    codec.width, codec.height, codec.pix_fmt = width, height, "rgb24"
    codec.time_base = Fraction(1)
    frame = av.VideoFrame.from_ndarray(np.ascontiguousarray(picture.pixels), format="rgb24")
    frame.pts = 0
    return b"".join(bytes(packet) for packet in (*codec.encode(frame), *codec.encode(None)))


def encode_jpeg(pixels: Pixels) -> bytes:
    """Return a picture, RGB, as a JPEG file: a sixth of a PNG, and a video is compressed anyway."""
    import cv2

    _, encoded = cv2.imencode(".jpg", pixels[..., ::-1], [cv2.IMWRITE_JPEG_QUALITY, JPEG_QUALITY])
    return encoded.tobytes()


def encode_mp4(clip: Clip) -> bytes:
    """Return a clip as an MP4 file, H.264."""
    _check_pyav()
    import av

    file = io.BytesIO()
    with av.open(file, "w", format="mp4") as container:
        stream = container.add_stream("libx264", rate=clip.rate.limit_denominator(1000))
        stream.height, stream.width = clip.frames.shape[1:3]
        stream.pix_fmt = "yuv420p"
        stream.options = {"crf": str(QUALITY), "preset": "veryfast"}
        # One thread, so that the same frames give the same bytes.
        stream.codec_context.thread_count = 1
        for pixels in clip.frames:
            frame = av.VideoFrame.from_ndarray(np.ascontiguousarray(pixels), format="rgb24")
            container.mux(stream.encode(frame))
        container.mux(stream.encode(None))
    return file.getvalue()


def _check_pyav() -> None:
    with extra_needed("Pictures for a model need PyAV", "sim"):
        import av  # noqa: F401 - an extra, and slow to import
