"""Films of episodes: small H.264 files that appear under their name only when complete."""

from __future__ import annotations

import contextlib
import functools
from collections.abc import Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np
from numpy.typing import NDArray

from roboirg.core.errors import MissingDependencyError, RenderDeviceError
from roboirg.util.text_overlay import draw_text, wrap_text

if TYPE_CHECKING:
    from av.container import OutputContainer
    from av.video.stream import VideoStream

Frame = NDArray[np.uint8]

DEMONSTRATION_COLOR = (255, 176, 32)
"""RGB of the border around what was shown before the policy's turn."""

BORDER = 6
GAP = 4
"""Pixels of the black line between two pictures; even, as H.264 wants the width."""
LAST_FRAME_REPEATS = 8
"""The end is what one wants to see: it stays for most of a second."""

POSTER_SUFFIX = ".jpg"

_TEXT_SCALE, _TEXT_LINE, _TEXT_MARGIN = 0.4, 16, 6
_MAX_LINES = 12
_INK, _PAPER = (31, 35, 40), 255


@dataclass(frozen=True, slots=True)
class VideoOptions:
    """How episodes are filmed.

    Attributes:
        every: control steps between two frames (20 control steps are one second).
        rate: frames per second in the film; 10 with every 8th step is fourfold speed.
        cameras: drawn side by side, 256 pixels each, a black line of `GAP` between them.
        quality: x264's constant rate factor; higher is smaller.
    """

    every: int = 8
    rate: int = 10
    cameras: tuple[str, ...] = ("front", "wrist")
    quality: int = 28


class PictureSource(Protocol):
    """Whatever draws a picture on request, as the environment does."""

    def picture(self, camera: str) -> Frame:
        """The camera's picture now, uint8 (256, 256, 3)."""


def check_video_support() -> None:
    """Complain now if films cannot be written.

    Raises:
        MissingDependencyError: PyAV is not installed.
    """
    try:
        import av  # noqa: F401 - an extra, and slow to import
    except ImportError as error:
        raise MissingDependencyError(
            f"Films need PyAV, which is not installed ({error}); run: "
            "pip install 'roboirgbench[sim]', or play with --video off."
        ) from error


def compose_frame(
    pictures: Sequence[Frame], caption: str = "", *, is_demonstration: bool = False
) -> Frame:
    """Pictures side by side, a line between them; what was shown before has a colored border.

    Args:
        pictures: uint8 (height, width, 3), all of one height.
        caption: goes below, broken into lines.
        is_demonstration: whether it was shown before the policy's turn.
    """
    line = np.zeros((pictures[0].shape[0], GAP, 3), np.uint8)
    parts = [part for picture in pictures for part in (line, picture)][1:]
    frame: Frame = np.concatenate(parts, axis=1)
    if is_demonstration:
        color = np.array(DEMONSTRATION_COLOR, np.uint8)
        frame[:BORDER] = frame[-BORDER:] = color
        frame[:, :BORDER] = frame[:, -BORDER:] = color
    return np.concatenate([frame, _caption_bar(caption, frame.shape[1])]) if caption else frame


@functools.lru_cache(maxsize=8)
def _caption_bar(caption: str, width: int) -> Frame:
    """A caption on paper; its height is even, as H.264 wants it."""
    lines = wrap_text(caption, width - 2 * _TEXT_MARGIN, _TEXT_SCALE)[:_MAX_LINES]
    height = len(lines) * _TEXT_LINE + 2 * _TEXT_MARGIN
    bar: Frame = np.full((height, width, 3), _PAPER, np.uint8)
    for number, text in enumerate(lines, start=1):
        draw_text(bar, text, _TEXT_MARGIN, number * _TEXT_LINE, _TEXT_SCALE, _INK)
    return bar


@dataclass
class VideoWriter:
    """A film in the making. Nothing exists under `path` until `finish`.

    A film that cannot be written is given up, whatever FFmpeg or the disk does: what is filmed
    goes on as if there were no film.

    Args:
        path: of the finished MP4; a poster of the last frame gets the same name with ``.jpg``.
        options: how to film.

    Attributes:
        caption: below the pictures; set before the first of them.
        trouble: why it was given up, or None.
    """

    path: Path
    options: VideoOptions = field(default_factory=VideoOptions)
    caption: str = field(default="", init=False)
    trouble: Exception | None = field(default=None, init=False)
    _container: OutputContainer | None = field(default=None, init=False, repr=False)
    _stream: VideoStream | None = field(default=None, init=False, repr=False)
    _last: Frame | None = field(default=None, init=False, repr=False)

    @property
    def partial(self) -> Path:
        """Where the film grows; a later film of the same name overwrites what a kill left."""
        return self.path.with_name(f".{self.path.name}.part")

    def shoot(self, world: PictureSource, is_demonstration: bool = False) -> None:
        """Add the world as it looks now.

        Raises:
            RenderDeviceError: no Vulkan device can render.
            MissingDependencyError: something has to be installed first.
        """
        if self.trouble is not None:
            return
        try:
            pictures = [world.picture(camera) for camera in self.options.cameras]
            self._add(compose_frame(pictures, self.caption, is_demonstration=is_demonstration))
        except (RenderDeviceError, MissingDependencyError):
            raise
        except Exception as error:  # noqa: BLE001 - see the class
            self._give_up(error)

    def finish(self) -> bool:
        """Complete the film and give it its name; False if it has no frame or was given up."""
        if self._last is None:
            return False
        poster = self.path.with_suffix(POSTER_SUFFIX)
        try:
            for _ in range(LAST_FRAME_REPEATS):
                self._add(self._last)
            last = self._last
            self._close()
            write_poster(last, poster)
            self.partial.replace(self.path)
        except Exception as error:  # noqa: BLE001 - see the class
            self._give_up(error)
            with contextlib.suppress(OSError):
                poster.unlink(missing_ok=True)
            return False
        return True

    def discard(self) -> None:
        """Throw away an unfinished film; never raises."""
        container = self._container
        self._container = self._stream = self._last = None
        if container is not None:
            with contextlib.suppress(Exception):
                container.close()
        with contextlib.suppress(OSError):
            self.partial.unlink(missing_ok=True)

    def _give_up(self, error: Exception) -> None:
        self.trouble = error
        self.discard()

    def _add(self, frame: Frame) -> None:
        """Add a frame, uint8 (height, width, 3), both even; all of one size."""
        container, stream = self._open(frame)
        import av

        self._last = frame
        container.mux(stream.encode(av.VideoFrame.from_ndarray(frame, format="rgb24")))

    def _open(self, frame: Frame) -> tuple[OutputContainer, VideoStream]:
        if self._container is not None and self._stream is not None:
            return self._container, self._stream
        import av

        self.path.parent.mkdir(parents=True, exist_ok=True)
        # The index goes to the front, so that a player can start before it has read everything.
        container = av.open(
            str(self.partial), "w", format="mp4", options={"movflags": "+faststart"}
        )
        stream = container.add_stream("libx264", rate=Fraction(self.options.rate))
        stream.height, stream.width = frame.shape[:2]
        stream.pix_fmt = "yuv420p"
        stream.options = {"crf": str(self.options.quality), "preset": "veryfast"}
        stream.codec_context.thread_count = 1
        self._container, self._stream = container, stream
        return container, stream

    def _close(self) -> None:
        container, stream = self._container, self._stream
        if container is not None and stream is not None:
            container.mux(stream.encode(None))
            container.close()
        self._container = self._stream = None


def write_poster(frame: Frame, path: Path) -> None:
    """Write one frame as a JPEG."""
    import av

    options: dict[str, Any] = {"update": "1"}
    with av.open(str(path), "w", format="image2", options=options) as container:
        stream = container.add_stream("mjpeg", rate=1)
        stream.height, stream.width = frame.shape[:2]
        stream.pix_fmt = "yuvj420p"
        picture = av.VideoFrame.from_ndarray(frame, format="rgb24")
        container.mux(stream.encode(picture))
        container.mux(stream.encode(None))
