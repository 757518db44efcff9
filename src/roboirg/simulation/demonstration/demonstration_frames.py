"""Pictures of a demonstration: drawn from a replay in a world of its own, or read back."""

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
from gymnasium import spaces
from numpy.typing import NDArray

from roboirg.core.episode import Episode, Stage
from roboirg.simulation.demonstration.demonstration_cache import recording_key
from roboirg.simulation.demonstration.recording import Recording
from roboirg.simulation.episode_session import EpisodeSession
from roboirg.simulation.observation_builder import draw
from roboirg.simulation.rendering.render_device import describe, find_render_device
from roboirg.simulation.rendering.render_mode import FAITHFUL, Rendering
from roboirg.util.cache import open_cache

LEVEL = 3
"""Of compression: higher ones save a fifth of the room and take three times as long."""
CHUNK = 64
"""Frames that are compressed together; half as many take a third more room."""
_LENGTH = struct.Struct("<Q")
_DRIVER_LIBRARIES = ("libvulkan_", "libGLX_nvidia", "libnvidia-glcore")


@dataclass(frozen=True)
class DemonstrationFramesArray:
    """All pictures of one kind in a demonstration.

    Attributes:
        episode: whose demonstration.
        recording: what was done in it.
        field: of an observation, such as ``"front_rgb"``.
        space: of one picture.
        every: steps of the video from one picture to the next.
        rendering: how they are drawn.
    """

    episode: Episode
    recording: Recording
    field: str
    space: spaces.Space[Any]
    every: int = 1
    rendering: Rendering = FAITHFUL

    def empty(self) -> NDArray[Any]:
        """An array for all of them, with a leading axis."""
        count = math.ceil(self.recording.length_of_video(self.episode) / self.every)
        return np.empty((count, *(self.space.shape or ())), self.space.dtype)

    def key(self) -> str:
        """What they are kept under."""
        parts = (
            recording_key(self.episode),
            self.recording.end,
            rendering_key(self.rendering),
            self.field,
            str(self.every),
        )
        return hashlib.sha256("\n".join(parts).encode()).hexdigest()


def read_frames(wanted: Sequence[DemonstrationFramesArray]) -> list[NDArray[Any]]:
    """Pictures of one demonstration; the same whether they are drawn or read back.

    Args:
        wanted: which; those that have to be drawn are drawn in one replay.
    """
    cache = open_cache("frames")
    arrays = [frames.empty() for frames in wanted]
    missing = []
    for frames, array in zip(wanted, arrays, strict=True):
        content = cache.read(frames.key()) if array.size else None
        if content is not None:
            _decompress(content, array)
        elif array.size:
            missing.append((frames, array))
    if missing:
        _draw(missing)
    for frames, array in missing if cache.enabled else ():
        cache.write(frames.key(), _compress(array))
    return arrays


def _draw(wanted: Sequence[tuple[DemonstrationFramesArray, NDArray[Any]]]) -> None:
    """Replay the demonstration and draw what is due into the arrays.

    The world goes on while pictures are drawn; they are fetched before the next ones begin.
    """
    (first, _), *_ = wanted
    session = EpisodeSession(first.episode, visible=True, rendering=first.rendering)
    world, cameras = session.world, session.world.cameras
    due = tuple(dict.fromkeys(frames.field.rpartition("_")[0] for frames, _ in wanted))
    steps = begun = 0

    def fetch() -> None:
        with cameras.looking_back():
            for frames, array in wanted:
                array[begun - 1] = draw(world, frames.field)

    def look(stage: Stage) -> None:
        del stage
        nonlocal steps, begun
        if steps % first.every == 0:
            if begun:
                fetch()
            cameras.draw(due)
            begun += 1
        steps += 1

    end = session.play_demonstration(look, first.recording).end
    fetch()
    if end != first.recording.end:
        raise RuntimeError(
            f"The demonstration of {first.episode.key} did not replay to the same end."
        )


def rendering_key(rendering: Rendering) -> str:
    """Everything that determines pictures of one and the same world."""
    device = describe(find_render_device())
    sapien = importlib.metadata.version("sapien")
    return "\n".join([repr(rendering), device.name, device.alias, sapien, *_driver_libraries()])


def _driver_libraries() -> list[str]:
    """The files of the Vulkan drivers in this process; SAPIEN does not tell their version."""
    try:
        mapped = Path("/proc/self/maps").read_text().splitlines()
    except OSError:
        return []
    paths = map(Path, {line.split(maxsplit=5)[5] for line in mapped if "/" in line})
    return [
        f"{path} {path.stat().st_size} {path.stat().st_mtime_ns}"
        for path in sorted(paths)
        if path.name.startswith(_DRIVER_LIBRARIES) and path.is_file()
    ]


def _compress(frames: NDArray[Any]) -> bytes:
    """Chunks of frames, each with its length before it."""
    compressor = zstandard.ZstdCompressor(level=LEVEL)
    parts: list[bytes] = []
    for start in range(0, len(frames), CHUNK):
        chunk = compressor.compress(frames[start : start + CHUNK].data)
        parts += [_LENGTH.pack(len(chunk)), chunk]
    return b"".join(parts)


def _decompress(content: memoryview, frames: NDArray[Any]) -> None:
    """Fill an array with what was compressed."""
    chunks = []
    place = 0
    for start in range(0, len(frames), CHUNK):
        (length,) = _LENGTH.unpack_from(content, place)
        place += _LENGTH.size
        chunks.append((content[place : place + length], frames[start : start + CHUNK]))
        place += length

    def fill(chunk: memoryview, part: NDArray[Any]) -> None:
        with zstandard.ZstdDecompressor().stream_reader(chunk) as reader:
            reader.readinto(part.data.cast("B"))

    with ThreadPoolExecutor(os.cpu_count()) as threads:
        for _ in threads.map(fill, *zip(*chunks, strict=True)):
            pass
