"""Videos of episodes: small H.264 files that appear under their name only when complete."""

from __future__ import annotations

import contextlib
import functools
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from roboirg.core.errors import EndOfRunError
from roboirg.core.extras import extra_needed
from roboirg.core.observations import CAMERAS, FRONT, Pixels
from roboirg.core.subgoal_text import Point
from roboirg.records.film import FRAME_RATE, FRAME_STEPS, LAST_FRAME_REPEATS, poster_name
from roboirg.util.media import Mp4Encoder, draw_text, encode_jpeg, wrap_text

if TYPE_CHECKING:
    from roboirg.envs.environment import RoboIRGEnv

DEMONSTRATION_COLOR = (255, 176, 32)
"""RGB of the border around the frames of the demonstration."""

# x264's macroblock tree reads memory that it has not written if the width is no multiple of 128:
# equal pictures would give files that differ. A higher constant rate factor gives smaller files.
_ENCODER_OPTIONS = {"crf": "28", "mbtree": "0"}

BORDER = 6
GAP = 4
"""Pixels of the black line between two pictures; even, because H.264 needs an even width."""

RING_COLOR = (255, 230, 0)
RING_RADIUS = 6
RING_WIDTH = 2
"""RGB and pixels of the ring around the point of a subgoal."""

_PARTIAL_SUFFIX = ".part"

_TEXT_SCALE = 0.4
"""Of the font's own size."""
_TEXT_LINE = 16
_TEXT_MARGIN = 6
"""Pixels of a line of a caption, and of the margin around its lines."""
_MAX_LINES = 12
_TEXT_COLOR = (31, 35, 40)
_BACKGROUND = 255


def check_video_support() -> None:
    """Check that videos can be written.

    Raises:
        MissingDependencyError: PyAV is not installed.
    """
    with extra_needed("Recording videos needs PyAV", "sim"):
        import av  # noqa: F401 - an extra, and slow to import


def compose_frame(
    pictures: Sequence[Pixels],
    caption: str = "",
    *,
    is_demonstration: bool = False,
    longest_caption: str = "",
) -> Pixels:
    """Return a frame of a video: pictures side by side, and a caption below them.

    Args:
        pictures: uint8 (height, width, 3), all of one height.
        caption: text below the pictures, wrapped into lines.
        is_demonstration: draw the border that marks the demonstration.
        longest_caption: text for which there is room, as all frames of a video have one size.

    Returns:
        uint8 (height, width, 3), with the height of the pictures if there is no caption.
    """
    height = pictures[0].shape[0]
    black_line = np.zeros((height, GAP, 3), np.uint8)
    parts = [pictures[0]]
    for picture in pictures[1:]:
        parts += [black_line, picture]
    frame: Pixels = np.concatenate(parts, axis=1)
    if is_demonstration:
        frame[:BORDER] = DEMONSTRATION_COLOR
        frame[-BORDER:] = DEMONSTRATION_COLOR
        frame[:, :BORDER] = DEMONSTRATION_COLOR
        frame[:, -BORDER:] = DEMONSTRATION_COLOR
    if not caption:
        return frame
    return np.concatenate([frame, _caption_bar(caption, frame.shape[1], longest_caption)])


def with_ring(picture: Pixels, point: Point) -> Pixels:
    """Return a copy of a picture, uint8 (height, width, 3), with a ring around a point.

    `point` is (row, column), pixels. Pixels are colored whose distance from it differs from the
    radius by half the ring's width at most.
    """
    row, column = point
    rows, columns = np.indices(picture.shape[:2])
    distances = np.hypot(rows - row, columns - column)
    is_ring = np.abs(distances - RING_RADIUS) <= RING_WIDTH / 2
    marked = picture.copy()
    marked[is_ring] = RING_COLOR
    return marked


@functools.lru_cache(maxsize=8)
def _caption_bar(caption: str, width: int, longest: str) -> Pixels:
    """Return an image of a caption, with room for the longest caption of the video.

    All its sizes in pixels are even, so that the height is, which H.264 needs.

    Args:
        caption: to draw.
        width: of the image, pixels.
        longest: caption of the video.
    """
    lines = _caption_lines(caption, width)
    room = max(len(lines), len(_caption_lines(longest, width)))
    height = room * _TEXT_LINE + 2 * _TEXT_MARGIN
    bar: Pixels = np.full((height, width, 3), _BACKGROUND, np.uint8)
    for number, text in enumerate(lines, start=1):
        draw_text(bar, text, _TEXT_MARGIN, number * _TEXT_LINE, _TEXT_SCALE, _TEXT_COLOR)
    return bar


def _caption_lines(text: str, width: int) -> list[str]:
    """Return the lines of a text in a bar of this width; what does not fit is left out."""
    return wrap_text(text, width - 2 * _TEXT_MARGIN, _TEXT_SCALE)[:_MAX_LINES]


@dataclass
class VideoWriter:
    """Writes one video. Nothing exists under `path` until `finish`.

    An error of FFmpeg or the disk ends the video, never the episode: it is kept in `error`, and
    later frames are ignored.

    Args:
        path: of the finished MP4; a poster of the last frame gets the same name with ``.jpg``.

    Attributes:
        every: control steps between two frames.
        caption: text below the pictures; set before the first frame.
        longest_caption: text for which there is room below the pictures, if the caption grows.
        point: row and column in the front picture, marked by a yellow ring.
        error: why the video could not be written, or None.
    """

    path: Path
    every: int = field(default=FRAME_STEPS, init=False)
    caption: str = field(default="", init=False)
    longest_caption: str = field(default="", init=False)
    point: Point | None = field(default=None, init=False)
    error: Exception | None = field(default=None, init=False)
    _video: Mp4Encoder | None = field(default=None, init=False, repr=False)
    _last_frame: Pixels | None = field(default=None, init=False, repr=False)

    @property
    def partial(self) -> Path:
        """Path of the unfinished video; a later video of the same name overwrites it."""
        return self.path.with_name(f".{self.path.name}{_PARTIAL_SUFFIX}")

    def add_frame(self, source: RoboIRGEnv, is_demonstration: bool = False) -> None:
        """Add a frame with the current pictures.

        Raises:
            RenderDeviceError: no Vulkan device can render.
            MissingDependencyError: a package has to be installed first.
        """
        if self.error is not None:
            return
        try:
            pictures = [source.picture(camera) for camera in CAMERAS]
            if self.point is not None:
                front = CAMERAS.index(FRONT)
                pictures[front] = with_ring(pictures[front], self.point)
            frame = compose_frame(
                pictures,
                self.caption,
                is_demonstration=is_demonstration,
                longest_caption=self.longest_caption,
            )
            self._encode(frame)
        except EndOfRunError:
            raise
        except Exception as error:  # noqa: BLE001 - see the class
            self._abandon(error)

    def finish(self) -> bool:
        """Complete the video and write its poster; return whether that was possible.

        It is not if there is no frame, or the file could not be written.
        """
        if self._last_frame is None or self._video is None:
            return False
        poster = Path(poster_name(str(self.path)))
        try:
            for _ in range(LAST_FRAME_REPEATS):
                self._encode(self._last_frame)
            poster.write_bytes(encode_jpeg(self._last_frame))
            self._video.close()
            self.partial.replace(self.path)
        except Exception as error:  # noqa: BLE001 - see the class
            self._abandon(error)
            with contextlib.suppress(OSError):
                poster.unlink(missing_ok=True)
            return False
        self._video = None
        return True

    def discard(self) -> None:
        """Close and delete an unfinished video, so that a new one can begin; never raises."""
        video = self._video
        self._video = None
        self._last_frame = None
        if video is not None:
            with contextlib.suppress(Exception):
                video.container.close()
        with contextlib.suppress(OSError):
            self.partial.unlink(missing_ok=True)

    def _abandon(self, error: Exception) -> None:
        """Give the video up because of an error."""
        self.error = error
        self.discard()

    def _encode(self, frame: Pixels) -> None:
        """Encode a frame, uint8 (height, width, 3); the first one begins the file.

        Height and width are even, and all frames have the same.
        """
        if self._video is None:
            self.path.parent.mkdir(parents=True, exist_ok=True)
            self._video = Mp4Encoder(self.partial, frame, Fraction(FRAME_RATE), _ENCODER_OPTIONS)
        self._last_frame = frame
        self._video.add(frame)


@contextlib.contextmanager
def without_unfinished_videos(folder: Path) -> Iterator[None]:
    """Delete what processes that died left of videos, before and after the body.

    Args:
        folder: of the videos, to which no other run writes.
    """
    _delete_unfinished(folder)
    try:
        yield
    finally:
        _delete_unfinished(folder)


def _delete_unfinished(folder: Path) -> None:
    for unfinished in folder.glob(f".*{_PARTIAL_SUFFIX}"):
        with contextlib.suppress(OSError):
            unfinished.unlink()
