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
from typing import Any

import numpy as np
import zstandard
from numpy.typing import NDArray

from roboirg.core.episode import Episode, Stage
from roboirg.simulation.episode_session import EpisodeSession
from roboirg.simulation.observation_builder import FieldFormat, read_picture
from roboirg.simulation.recording import Recording
from roboirg.simulation.rendering.render_device import describe_device, find_render_device
from roboirg.simulation.rendering.render_settings import FAITHFUL, RenderSettings
from roboirg.simulation.video.demonstration_cache import recording_key
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
    arrays = [sequence.empty() for sequence in sequences]
    missing = []
    for sequence, array in zip(sequences, arrays, strict=True):
        content = cache.read(sequence.key()) if array.size else None
        if content is not None:
            _decompress(content, array)
        elif array.size:
            missing.append((sequence, array))
    if missing:
        _draw(missing)
    for sequence, array in missing if cache.enabled else ():
        cache.write(sequence.key(), _compress(array))
    return arrays


def _draw(missing: Sequence[tuple[FrameSequence, NDArray[Any]]]) -> None:
    """Replay the demonstration and draw the pictures into the arrays.

    The renderer draws a picture while the world goes on, so a picture is fetched only when the
    next one is due, and the last one at the end.
    """
    (first, _), *_ = missing
    session = EpisodeSession(first.episode, visible=True, rendering=first.rendering)
    world, cameras = session.world, session.world.cameras
    drawing = tuple(dict.fromkeys(sequence.field.rpartition("_")[0] for sequence, _ in missing))
    steps = pictures = 0  # seen, and begun

    def fetch() -> None:
        """Read the pictures begun last."""
        with cameras.frozen():
            for sequence, array in missing:
                array[pictures - 1] = read_picture(world, sequence.field)

    def draw_if_due(stage: Stage) -> None:
        del stage
        nonlocal steps, pictures
        if steps % first.every == 0:
            if pictures:
                fetch()
            cameras.draw(drawing)
            pictures += 1
        steps += 1

    end = session.play_demonstration(draw_if_due, first.recording).end
    fetch()
    if end != first.recording.end:
        raise RuntimeError(
            f"The demonstration of {first.episode.key} did not replay to the same state."
        )


def rendering_key(rendering: RenderSettings) -> str:
    """Return everything that determines the pictures of a given world."""
    device = describe_device(find_render_device())
    sapien = importlib.metadata.version("sapien")
    return "\n".join([repr(rendering), device.name, device.alias, sapien, *_driver_libraries()])


def _driver_libraries() -> list[str]:
    """Return the Vulkan driver files of this process; SAPIEN does not report their version."""
    try:
        mapped = os.fsdecode(Path("/proc/self/maps").read_bytes()).splitlines()
    except OSError:
        return []
    paths = map(Path, {line.split(maxsplit=5)[5] for line in mapped if "/" in line})
    return [
        f"{path} {path.stat().st_size} {path.stat().st_mtime_ns}"
        for path in sorted(paths)
        if path.name.startswith(_DRIVER_LIBRARIES) and path.is_file()
    ]


def _compress(frames: NDArray[Any]) -> bytes:
    """Compress frames in chunks, each preceded by its length."""
    compressor = zstandard.ZstdCompressor(level=COMPRESSION_LEVEL)
    parts: list[bytes] = []
    for start in range(0, len(frames), CHUNK):
        chunk = compressor.compress(frames[start : start + CHUNK].data)
        parts += [_LENGTH.pack(len(chunk)), chunk]
    return b"".join(parts)


def _decompress(content: memoryview, frames: NDArray[Any]) -> None:
    """Decompress the output of `_compress` into an array."""
    chunks = []
    offset = 0
    for start in range(0, len(frames), CHUNK):
        (length,) = _LENGTH.unpack_from(content, offset)
        offset += _LENGTH.size
        chunks.append((content[offset : offset + length], frames[start : start + CHUNK]))
        offset += length

    def fill(chunk: memoryview, part: NDArray[Any]) -> None:
        with zstandard.ZstdDecompressor().stream_reader(chunk) as reader:
            reader.readinto(part.data.cast("B"))

    with ThreadPoolExecutor(os.cpu_count()) as threads:
        for _ in threads.map(fill, *zip(*chunks, strict=True)):
            pass
