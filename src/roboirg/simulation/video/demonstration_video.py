"""The demonstration shown to a policy: arrays, with pictures drawn when they are read."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from roboirg.core.episode import Episode
from roboirg.core.observations import FetchedDemonstration
from roboirg.simulation.observation_builder import (
    ObservationSpec,
    picture_fields,
    stack_proprioception,
)
from roboirg.simulation.recording import Recording
from roboirg.simulation.video.frame_sequence import FrameSequence, read_frames


class DemonstrationVideo(FetchedDemonstration):
    """A demonstration as a mapping from an observation's fields to arrays, with a leading axis T.

    Pictures are drawn when they are first read, at any later time; `draw` draws all that are left
    in one replay for all cameras. Pickling draws all pictures and leaves the actions out. The
    pickled video is no dictionary either: Gymnasium's vector environments put the arrays of
    dictionaries into one, and videos differ in length.

    Attributes:
        actions: (T, 8) joint targets (rad) and the gripper, that led to each step; no policy sees
            them.
    """

    def __init__(
        self,
        proprioception: Mapping[str, NDArray[Any]],
        sequences: Mapping[str, FrameSequence],
        actions: NDArray[np.float64],
    ) -> None:
        fields = dict.fromkeys([*sequences, *proprioception])
        super().__init__(tuple(fields), proprioception, partial(_read, sequences))
        self.actions = actions
        self._sequences = sequences

    def __reduce__(self) -> tuple[type[Self], tuple[Any, ...]]:
        self.draw()
        return type(self), (dict(self), {}, self.actions[:0])

    def __repr__(self) -> str:
        fields = []
        for field in self._sequences:
            state = "drawn" if field in self._arrays else "not drawn"
            fields.append(f"{field} ({state})")
        fields += [field for field in self._arrays if field not in self._sequences]
        return f"<Video of {self.length} steps: {', '.join(fields)}>"


def _read(sequences: Mapping[str, FrameSequence], fields: Sequence[str]) -> dict[str, NDArray[Any]]:
    """Return the pictures of some fields, cached or drawn."""
    frames = read_frames([sequences[field] for field in fields])
    return dict(zip(fields, frames, strict=True))


def make_video(
    episode: Episode,
    recording: Recording,
    spec: ObservationSpec,
    proprioception: Sequence[dict[str, Any]],
) -> DemonstrationVideo:
    """Return the video of a demonstration that has been played.

    Args:
        episode: whose demonstration it is.
        recording: its actions, from which pictures are drawn later.
        spec: which fields the video has, and every how many steps a picture.
        proprioception: readings of `ObservationBuilder.read_proprioception`, one a step.
    """
    frames = spec.demonstration_frames
    every = frames if isinstance(frames, int) else 1
    sequences = {}
    if frames != "none":
        for field, kind in picture_fields(spec).items():
            sequence = FrameSequence(episode, recording, field, kind, every, spec.rendering)
            sequences[field] = sequence
    arrays = stack_proprioception(proprioception, spec)
    actions = recording.video_actions(episode)
    return DemonstrationVideo(arrays, sequences, actions)
