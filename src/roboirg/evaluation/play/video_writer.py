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
from roboirg.evaluation.records.film import FRAME_RATE, FRAME_STEPS, LAST_FRAME_REPEATS, poster_name
from roboirg.util.media import draw_text, encode_jpeg, wrap_text

if TYPE_CHECKING:
    from av.container import OutputContainer
    from av.video.stream import VideoStream

    from roboirg.envs.environment import RoboIRGEnv

DEMONSTRATION_COLOR = (255, 176, 32)
"""RGB of the border around the frames of the demonstration."""

QUALITY = 28
"""x264's constant rate factor; higher is smaller."""

BORDER = 6
GAP = 4
"""Pixels of the black line between two pictures; even, because H.264 needs an even width."""

RING_COLOR, RING_RADIUS, RING_WIDTH = (255, 230, 0), 6, 2
"""RGB and pixels of the ring around the point of a subgoal."""

_PARTIAL_SUFFIX = ".part"

_TEXT_SCALE, _TEXT_LINE, _TEXT_MARGIN = 0.4, 16, 6
_MAX_LINES = 12
_TEXT_COLOR, _BACKGROUND = (31, 35, 40), 255


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
    """Return one frame with the pictures side by side and a line between them.

    Args:
        pictures: uint8 (height, width, 3), all of one height.
        caption: text below the pictures, wrapped into lines.
        is_demonstration: draw the border that marks the demonstration.
        longest_caption: text for which there is room, as all frames of a video have one size.
    """
    line = np.zeros((pictures[0].shape[0], GAP, 3), np.uint8)
    parts = [part for picture in pictures for part in (line, picture)][1:]
    frame: Pixels = np.concatenate(parts, axis=1)
    if is_demonstration:
        color = np.array(DEMONSTRATION_COLOR, np.uint8)
        frame[:BORDER] = frame[-BORDER:] = color
        frame[:, :BORDER] = frame[:, -BORDER:] = color
    if not caption:
        return frame
    return np.concatenate([frame, _caption_bar(caption, frame.shape[1], longest_caption)])


def with_ring(picture: Pixels, point: Point) -> Pixels:
    """Return a copy of a picture with a ring around a point; inside it the picture is unchanged."""
    rows, columns = np.indices(picture.shape[:2])
    distance = np.hypot(rows - point[0], columns - point[1])
    marked = picture.copy()
    marked[np.abs(distance - RING_RADIUS) <= RING_WIDTH / 2] = RING_COLOR
    return marked


@functools.lru_cache(maxsize=8)
def _caption_bar(caption: str, width: int, longest: str) -> Pixels:
    """Return a caption as an image; its height is even, because H.264 needs that."""
    lines, room = (
        wrap_text(text, width - 2 * _TEXT_MARGIN, _TEXT_SCALE)[:_MAX_LINES]
        for text in (caption, longest)
    )
    height = max(len(lines), len(room)) * _TEXT_LINE + 2 * _TEXT_MARGIN
    bar: Pixels = np.full((height, width, 3), _BACKGROUND, np.uint8)
    for number, text in enumerate(lines, start=1):
        draw_text(bar, text, _TEXT_MARGIN, number * _TEXT_LINE, _TEXT_SCALE, _TEXT_COLOR)
    return bar


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
    _output: tuple[OutputContainer, VideoStream] | None = field(
        default=None, init=False, repr=False
    )
    _last: Pixels | None = field(default=None, init=False, repr=False)

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
                place = CAMERAS.index(FRONT)
                pictures[place] = with_ring(pictures[place], self.point)
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
        """Complete the video. Returns False if it has no frame or could not be written."""
        if self._last is None or self._output is None:
            return False
        poster = Path(poster_name(str(self.path)))
        try:
            for _ in range(LAST_FRAME_REPEATS):
                self._encode(self._last)
            poster.write_bytes(encode_jpeg(self._last))
            container, stream = self._output
            container.mux(stream.encode(None))
            container.close()
            self.partial.replace(self.path)
        except Exception as error:  # noqa: BLE001 - see the class
            self._abandon(error)
            with contextlib.suppress(OSError):
                poster.unlink(missing_ok=True)
            return False
        self._output = None
        return True

    def discard(self) -> None:
        """Delete an unfinished video; never raises."""
        output, self._output, self._last = self._output, None, None
        if output is not None:
            with contextlib.suppress(Exception):
                output[0].close()
        with contextlib.suppress(OSError):
            self.partial.unlink(missing_ok=True)

    def _abandon(self, error: Exception) -> None:
        self.error = error
        self.discard()

    def _encode(self, frame: Pixels) -> None:
        """Encode a frame, uint8 (height, width, 3), both even; all of one size."""
        import av

        container, stream = self._output = self._output or self._open(frame)
        self._last = frame
        container.mux(stream.encode(av.VideoFrame.from_ndarray(frame, format="rgb24")))

    def _open(self, frame: Pixels) -> tuple[OutputContainer, VideoStream]:
        import av

        self.path.parent.mkdir(parents=True, exist_ok=True)
        # The index goes to the front, so that a player can start before it has read the whole file.
        container = av.open(
            str(self.partial), "w", format="mp4", options={"movflags": "+faststart"}
        )
        stream = container.add_stream("libx264", rate=Fraction(FRAME_RATE))
        stream.height, stream.width = frame.shape[:2]
        stream.pix_fmt = "yuv420p"
        # x264's macroblock tree reads memory that it has not written if the width is no multiple of
        # 128: equal pictures would give files that differ.
        stream.options = {"crf": str(QUALITY), "preset": "veryfast", "mbtree": "0"}
        stream.codec_context.thread_count = 1
        return container, stream


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
    for left in folder.glob(f".*{_PARTIAL_SUFFIX}"):
        with contextlib.suppress(OSError):
            left.unlink()
