"""Pictures of a demonstration, drawn by a replay in a separate world or read from the cache."""

from __future__ import annotations

import hashlib
import importlib.metadata
import math
import os
import struct
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import zstandard
from numpy.typing import NDArray

from roboirg.core.episode import Episode, Stage
from roboirg.simulation.episode_session import EpisodeSession
from roboirg.simulation.observation_builder import FieldFormat, cameras_of, read_picture
from roboirg.simulation.recording import Recording
from roboirg.simulation.rendering.render_device import describe_device, find_render_device
from roboirg.simulation.rendering.render_settings import FAITHFUL, RenderSettings
from roboirg.simulation.video.demonstration_cache import recording_key
from roboirg.simulation.world import World
from roboirg.util.cache import open_cache

COMPRESSION_LEVEL = 3
"""Higher levels save a fifth of the space and take three times as long."""
CHUNK = 64
"""Frames compressed together; half as many take a third more space."""
_LENGTH = struct.Struct("<Q")
_DRIVER_LIBRARIES = ("libvulkan_", "libGLX_nvidia", "libnvidia-glcore")


@dataclass(frozen=True)
class FrameSequence:
    """All pictures of one observation field in a demonstration, identified but not yet drawn.

    Attributes:
        episode: the episode.
        recording: the recorded demonstration.
        field: observation field, for example ``"front_rgb"``.
        format: of one picture.
        every: steps of the video from one picture to the next.
        rendering: how pictures are drawn.
    """

    episode: Episode
    recording: Recording
    field: str
    format: FieldFormat
    every: int = 1
    rendering: RenderSettings = FAITHFUL

    def empty(self) -> NDArray[Any]:
        """Return an uninitialized array for all pictures, with a leading axis."""
        count = math.ceil(self.recording.video_length(self.episode) / self.every)
        return np.empty((count, *self.format.shape), self.format.dtype)

    def key(self) -> str:
        """Return the name of the pictures in the cache: a hash of all that determines them."""
        parts = (
            recording_key(self.episode),
            self.recording.end,
            rendering_key(self.rendering),
            self.field,
            str(self.every),
        )
        return hashlib.sha256("\n".join(parts).encode()).hexdigest()


def read_frames(sequences: Sequence[FrameSequence]) -> list[NDArray[Any]]:
    """Return the pictures of several sequences of one demonstration, cached or drawn.

    Sequences that are not cached are drawn in one replay.
    """
    cache = open_cache("frames")
    pictures = [_Pictures(sequence, sequence.empty()) for sequence in sequences]
    missing = []
    for sequence, array in pictures:
        if not array.size:
            continue
        content = cache.read(sequence.key())
        if content is None:
            missing.append(_Pictures(sequence, array))
        else:
            _decompress(content, array)
    if missing:
        _draw(missing)
        if cache.enabled:
            for sequence, array in missing:
                cache.write(sequence.key(), _compress(array))
    return [array for _, array in pictures]


class _Pictures(NamedTuple):
    """A sequence and the array for its pictures."""

    sequence: FrameSequence
    array: NDArray[Any]


def _draw(missing: Sequence[_Pictures]) -> None:
    """Replay a demonstration and draw the pictures of some sequences into their arrays, in place.

    All are of one demonstration, with the same `every` and `rendering`.
    """
    first = missing[0].sequence
    session = EpisodeSession(first.episode, visible=True, rendering=first.rendering)
    drawing = _Drawing(session.world, missing)
    end = session.play_demonstration(drawing.after_step, first.recording).end
    drawing.fetch()
    if end != first.recording.end:
        raise RuntimeError(
            f"The demonstration of {first.episode.key} did not replay to the same state."
        )


class _Drawing:
    """Draws the pictures of a demonstration while it is replayed.

    The renderer draws a picture while the world goes on, so a picture is fetched only when the
    next one is due, and the last one at the end.
    """

    def __init__(self, world: World, pictures: Sequence[_Pictures]) -> None:
        self._world = world
        self._pictures = pictures
        self._cameras = cameras_of(sequence.field for sequence, _ in pictures)
        self._every = pictures[0].sequence.every
        self._steps = 0
        self._begun = 0

    def after_step(self, stage: Stage) -> None:
        """Begin pictures if they are due, after those that were begun before have been read."""
        del stage
        if self._steps % self._every == 0:
            if self._begun:
                self.fetch()
            self._world.cameras.draw(self._cameras)
            self._begun += 1
        self._steps += 1

    def fetch(self) -> None:
        """Read the pictures that were begun last."""
        with self._world.cameras.frozen():
            for sequence, array in self._pictures:
                array[self._begun - 1] = read_picture(self._world, sequence.field)


def rendering_key(rendering: RenderSettings) -> str:
    """Return everything that determines the pictures of a given world."""
    device = describe_device(find_render_device())
    sapien = importlib.metadata.version("sapien")
    return "\n".join([repr(rendering), device.name, device.alias, sapien, *_driver_libraries()])


def _driver_libraries() -> list[str]:
    """Return the Vulkan driver's files in this process, with their sizes and times.

    SAPIEN does not report the driver's version.
    """
    try:
        mapped = os.fsdecode(Path("/proc/self/maps").read_bytes()).splitlines()
    except OSError:
        return []
    # The path is the sixth column, for example 7f01-7f02 r-xp 00000000 08:01 42 /usr/lib/libGL.so
    paths = {Path(line.split(maxsplit=5)[5]) for line in mapped if "/" in line}
    libraries = []
    for path in sorted(paths):
        if path.name.startswith(_DRIVER_LIBRARIES) and path.is_file():
            status = path.stat()
            libraries.append(f"{path} {status.st_size} {status.st_mtime_ns}")
    return libraries


def _compress(frames: NDArray[Any]) -> bytes:
    """Compress frames in chunks, each preceded by its length; `_decompress` reads them."""
    compressor = zstandard.ZstdCompressor(level=COMPRESSION_LEVEL)
    parts: list[bytes] = []
    for start in range(0, len(frames), CHUNK):
        chunk = compressor.compress(frames[start : start + CHUNK].data)
        parts += [_LENGTH.pack(len(chunk)), chunk]
    return b"".join(parts)


def _decompress(content: memoryview, frames: NDArray[Any]) -> None:
    """Decompress the output of `_compress` into an array of the same shape, with all cores."""
    tasks = []
    offset = 0
    with ThreadPoolExecutor(os.cpu_count()) as threads:
        for start in range(0, len(frames), CHUNK):
            (length,) = _LENGTH.unpack_from(content, offset)
            offset += _LENGTH.size
            chunk = content[offset : offset + length]
            offset += length
            tasks.append(threads.submit(_fill, frames[start : start + CHUNK], chunk))
    for task in tasks:
        task.result()  # raises what the thread has raised


def _fill(frames: NDArray[Any], chunk: memoryview) -> None:
    """Decompress one chunk into its frames."""
    with zstandard.ZstdDecompressor().stream_reader(chunk) as reader:
        reader.readinto(frames.data.cast("B"))
