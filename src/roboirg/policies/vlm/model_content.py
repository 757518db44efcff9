"""The parts of a message to a model: words, pictures and clips, and their encoding."""

from __future__ import annotations

from fractions import Fraction
from typing import Literal, NamedTuple

from roboirg.core.observations import Pixels
from roboirg.util.media import VIDEO_RATE, Clip, Picture, sample_evenly

Part = str | Picture | Clip


class ChatTurn(NamedTuple):
    """One turn of a conversation."""

    role: Literal["user", "model"]
    parts: tuple[Part, ...]


def summary_clip(frames: Pixels, most: int, steps: int) -> Clip:
    """Return a clip of at most `most` frames that lasts as long as the whole video.

    Args:
        frames: uint8 (T, height, width, 3), T >= 1.
        most: limit of the frames of the clip.
        steps: control steps of the video; each takes 1/30 s.
    """
    kept = sample_evenly(frames, most)
    return Clip(kept, Fraction(VIDEO_RATE * len(kept), max(steps, len(kept))))
