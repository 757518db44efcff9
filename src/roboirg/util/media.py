"""Pictures and clips, and their encoding as PNG, JPEG and MP4 files."""

from __future__ import annotations

import functools
import io
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from roboirg.core.errors import InvalidValueError
from roboirg.core.extras import extra_needed
from roboirg.core.observations import Pixels

VIDEO_RATE = 30
"""Frames per second at which MME-VLA's planners show control steps (20 per second of the world)."""
CONTROL_RATE = 20
"""Control steps per second: videos run as fast as the world."""
QUALITY = 23
"""x264's constant rate factor, its default."""
JPEG_QUALITY = 90
SHEET_SIDE = 4
"""Frames in a row, and rows, of a sheet."""
_LABEL_X = 4
_LABEL_Y = 14
_LABEL_SCALE = 0.45
"""Place and size of a frame's label, as in `draw_text`."""


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
    """Return at most `most` of frames (T, …), evenly spaced, including the first and the last."""
    if len(frames) <= most:
        return frames
    return frames[evenly_spaced(len(frames), most)]


def evenly_spaced(count: int, most: int) -> NDArray[np.intp]:
    """Return at most `most` of `count` indices, evenly spaced, including the first and the last.

    7 and 3 -> ``[0, 3, 6]``; 2 and 3 -> ``[0, 1]``.
    """
    return np.linspace(0, count - 1, min(count, most)).round().astype(np.intp)


def scaled_square(picture: NDArray[Any], size: int) -> NDArray[Any]:
    """Crop a picture to its central square and scale it to `size` x `size` pixels.

    The picture is (height, width, 3) or (height, width); the result has as many channels.
    """
    import cv2

    height, width = picture.shape[:2]
    side = min(height, width)
    top = (height - side) // 2
    left = (width - side) // 2
    square = picture[top : top + side, left : left + side]
    return np.asarray(cv2.resize(square, (size, size), interpolation=cv2.INTER_AREA))


def contact_sheets(frames: Pixels, labels: Sequence[str]) -> Iterator[Pixels]:
    """Yield sheets, each a picture of up to `SHEET_SIDE` ** 2 frames in reading order, with labels.

    Frames have half their size.

    Args:
        frames: uint8 (T, height, width, 3).
        labels: T short texts, such as times.
    """
    small = np.ascontiguousarray(frames[:, ::2, ::2])  # every second row and column, as a copy
    for frame, label in zip(small, labels, strict=True):
        # White with a black edge.
        draw_text(frame, label, _LABEL_X, _LABEL_Y, _LABEL_SCALE, (0, 0, 0), thickness=3)
        draw_text(frame, label, _LABEL_X, _LABEL_Y, _LABEL_SCALE, (255, 255, 255))
    for start in range(0, len(small), SHEET_SIDE**2):
        yield _sheet(small[start : start + SHEET_SIDE**2])


def _sheet(frames: Pixels) -> Pixels:
    """Return frames (n, height, width, 3) as one picture, in rows of `SHEET_SIDE`.

    What is missing in the last row is black.
    """
    count, height, width, _ = frames.shape
    rows = math.ceil(count / SHEET_SIDE)
    places = np.zeros((rows * SHEET_SIDE, height, width, 3), np.uint8)
    places[:count] = frames
    # From (row, column, y, x) to (row, y, column, x), which is one picture.
    grid = places.reshape(rows, SHEET_SIDE, height, width, 3).swapaxes(1, 2)
    return grid.reshape(rows * height, SHEET_SIDE * width, 3)


def encode_png(picture: Picture) -> bytes:
    """Return a picture as a PNG file, by PyAV, which every installation with a simulator has."""
    _check_pyav()
    import av

    codec = av.CodecContext.create("png", "w")
    codec.height, codec.width = picture.pixels.shape[:2]
    codec.pix_fmt = "rgb24"
    codec.time_base = Fraction(1)
    frame = av.VideoFrame.from_ndarray(np.ascontiguousarray(picture.pixels), format="rgb24")
    frame.pts = 0
    packets = [*codec.encode(frame), *codec.encode(None)]
    return b"".join(bytes(packet) for packet in packets)


def decode_png(content: bytes) -> Pixels:
    """Return the picture of a PNG, RGB (height, width, 3).

    Raises:
        InvalidValueError: it is damaged.
    """
    import cv2

    found = cv2.imdecode(np.frombuffer(content, np.uint8), cv2.IMREAD_COLOR)
    if found is None:
        raise InvalidValueError("A picture of the dataset is damaged.")
    return np.asarray(cv2.cvtColor(found, cv2.COLOR_BGR2RGB), dtype=np.uint8)


def encode_jpeg(pixels: Pixels) -> bytes:
    """Return a picture, RGB, as a JPEG file: a sixth of a PNG, and a video is compressed anyway."""
    import cv2

    _, encoded = cv2.imencode(".jpg", pixels[..., ::-1], [cv2.IMWRITE_JPEG_QUALITY, JPEG_QUALITY])
    return encoded.tobytes()


def encode_mp4(clip: Clip) -> bytes:
    """Return a clip as an MP4 file, H.264; the same frames give the same bytes on one machine."""
    _check_pyav()
    file = io.BytesIO()
    rate = clip.rate.limit_denominator(1000)
    encoder = Mp4Encoder(file, clip.frames[0], rate, {"crf": str(QUALITY)})
    for frame in clip.frames:
        encoder.add(frame)
    encoder.close()
    return file.getvalue()


class Mp4Encoder:
    """Encodes one video as H.264 in MP4: `add` each frame in order, then `close` once.

    One thread encodes, so that the same frames give the same bytes on one machine.

    Args:
        target: path of the file, or a file in memory.
        example: a frame, (height, width, 3); all have its size, in even numbers.
        rate: frames per second.
        options: of the encoder, such as ``{"crf": "23"}``, its constant rate factor.
        codec: FFmpeg's name of the encoder.
        pixels: FFmpeg's name of the format in which pixels are encoded.
    """

    def __init__(
        self,
        target: Path | io.BytesIO,
        example: Pixels,
        rate: Fraction,
        options: Mapping[str, str],
        codec: str = "libx264",
        pixels: str = "yuv420p",
    ) -> None:
        import av

        of_file = {}
        if isinstance(target, Path):
            # The index goes to the front, so that a player can start before it has read the whole
            # file.
            of_file["movflags"] = "+faststart"
        self.container = av.open(target, "w", format="mp4", options=of_file)
        stream: Any = self.container.add_stream(codec, rate=rate)
        stream.height, stream.width = example.shape[:2]
        stream.pix_fmt = pixels
        stream.options = {"preset": "veryfast", **options}
        stream.codec_context.thread_count = 1
        self._stream = stream

    def add(self, frame: Pixels) -> None:
        """Encode a frame, uint8 (height, width, 3), RGB."""
        import av

        pixels = np.ascontiguousarray(frame)
        self.container.mux(self._stream.encode(av.VideoFrame.from_ndarray(pixels, format="rgb24")))

    def close(self) -> None:
        """Write the frames that the encoder still holds, and complete the file."""
        self.container.mux(self._stream.encode(None))
        self.container.close()


def _check_pyav() -> None:
    """Raise if PyAV is not installed, with what to run."""
    with extra_needed("Pictures for a model need PyAV", "sim"):
        import av  # noqa: F401 - an extra, and slow to import


Rgb = tuple[int, int, int]
"""RGB, 0 to 255."""

_FONT = 0  # cv2.FONT_HERSHEY_SIMPLEX; importing OpenCV is slow


def draw_text(
    image: Pixels, text: str, x: int, y: int, scale: float, color: Rgb, thickness: int = 1
) -> None:
    """Draw a line of text into a picture; characters outside ASCII become ``?``.

    Args:
        image: uint8 (height, width, 3), changed in place.
        text: one line.
        x: left end of the text, pixels.
        y: base line of the text, pixels.
        scale: size of the font; 1 is about 22 pixels high.
        color: RGB.
        thickness: width of the strokes, pixels.
    """
    import cv2

    ascii_text = text.encode("ascii", "replace").decode()
    cv2.putText(image, ascii_text, (x, y), _FONT, scale, color, thickness, cv2.LINE_AA)


def wrap_text(text: str, width: int, scale: float) -> list[str]:
    """Split a text into lines of at most `width` pixels; a longer word gets a line of its own.

    Each word goes to the end of the last line if it fits there.
    """
    lines: list[str] = []
    for word in text.split():
        if lines:
            longer = f"{lines[-1]} {word}"
            if _text_width(longer, scale) <= width:
                lines[-1] = longer
                continue
        lines.append(word)
    return lines


def _text_width(text: str, scale: float) -> int:
    """Return the width of a line of text, pixels."""
    import cv2

    (width, _), _ = cv2.getTextSize(text, _FONT, scale, 1)
    return width
