"""Pictures of a demonstration: drawn from a replay in a world of its own, or read back."""

from __future__ import annotations

import hashlib
import importlib.metadata
import math
import struct
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import zstandard
from gymnasium import spaces
from numpy.typing import NDArray

from roboirg.cache import open_cache
from roboirg.episode import Episode, Stage
from roboirg.simulation.demonstration.library import recording_key
from roboirg.simulation.demonstration.recording import Recording
from roboirg.simulation.device import describe, find_render_device
from roboirg.simulation.rendering import FAITHFUL, Rendering
from roboirg.simulation.senses import draw
from roboirg.simulation.session import Session

LEVEL = 3
"""Of compression: higher ones save a fifth of the room and take three times as long."""
CHUNK = 64
"""Frames that are compressed together; half as many take a third more room."""
_LENGTH = struct.Struct("<Q")
_DRIVER_LIBRARIES = ("libvulkan_", "libGLX_nvidia", "libnvidia-glcore")


@dataclass(frozen=True)
class Frames:
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

    def read(self) -> NDArray[Any]:
        """The pictures with a leading axis; the same whether they are drawn or read back."""
        frames = np.empty(self._shape(), self.space.dtype)
        if not frames.size:
            return frames
        cache, key = open_cache("frames"), self._key()
        content = cache.read(key)
        if content is not None:
            _decompress(content, frames)
        else:
            self._draw(frames)
            cache.write(key, _compress(frames))
        return frames

    def _shape(self) -> tuple[int, ...]:
        count = math.ceil(self.recording.length_of_video(self.episode) / self.every)
        return (count, *(self.space.shape or ()))

    def _draw(self, frames: NDArray[Any]) -> None:
        """Replay the demonstration and draw what is due."""
        session = Session(self.episode, visible=True, rendering=self.rendering)
        steps = 0

        def look(stage: Stage) -> None:
            del stage
            nonlocal steps
            if steps % self.every == 0:
                frames[steps // self.every] = draw(session.world, self.field)
            steps += 1

        if session.play_demonstration(look, self.recording).end != self.recording.end:
            raise RuntimeError(
                f"The demonstration of {self.episode.key} did not replay to the same end."
            )

    def _key(self) -> str:
        parts = (
            recording_key(self.episode),
            self.recording.end,
            rendering_key(self.rendering),
            self.field,
            str(self.every),
        )
        return hashlib.sha256("\n".join(parts).encode()).hexdigest()


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
    decompressor = zstandard.ZstdDecompressor()
    place = 0
    for start in range(0, len(frames), CHUNK):
        (length,) = _LENGTH.unpack_from(content, place)
        place += _LENGTH.size
        part = frames[start : start + CHUNK]
        # At once: as a stream it takes three times as long.
        raw = decompressor.decompress(content[place : place + length])
        part[:] = np.frombuffer(raw, part.dtype).reshape(part.shape)
        place += length
