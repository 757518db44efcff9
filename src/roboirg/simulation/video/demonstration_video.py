"""The demonstration shown to a policy: arrays, with pictures drawn when they are read."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from roboirg.core.episode import Episode
from roboirg.simulation.observation_builder import (
    ObservationSpec,
    picture_fields,
    stack_proprioception,
)
from roboirg.simulation.recording import Recording
from roboirg.simulation.video.frame_sequence import FrameSequence, read_frames


class DemonstrationVideo(Mapping[str, NDArray[Any]]):
    """A demonstration as a mapping from an observation's fields to arrays, with a leading axis T.

    Pictures are drawn when they are first read, at any later time, and then stored. To read
    several picture fields, call `draw` first, which is faster. Pickling draws all pictures and
    leaves the actions out. The pickled video is no dictionary either: Gymnasium's vector
    environments put the arrays of dictionaries into one, and videos differ in length.

    Attributes:
        length: control steps in the video, T.
        actions: (T, 8) joint targets (rad) and the gripper, that led to each step; no policy sees
            them.
    """

    def __init__(
        self,
        proprioception: Mapping[str, NDArray[Any]],
        sequences: Mapping[str, FrameSequence],
        length: int,
        actions: NDArray[np.float64],
    ) -> None:
        self.length, self.actions = length, actions
        self._arrays = dict(proprioception)
        self._sequences = dict(sequences)

    def __getitem__(self, field: str) -> NDArray[Any]:
        """Return a field for all steps; raises KeyError if it does not exist."""
        if field not in self._arrays:
            self._read((field,))
        return self._arrays[field]

    def undrawn(self) -> Self:
        """Return a copy without the pictures that can be drawn again."""
        read = {field: one for field, one in self._arrays.items() if field not in self._sequences}
        return type(self)(read, self._sequences, self.length, self.actions)

    def draw(self) -> None:
        """Draw all pictures that have not been drawn, in one replay for all cameras."""
        self._read([field for field in self._sequences if field not in self._arrays])

    def _read(self, fields: Sequence[str]) -> None:
        arrays = read_frames([self._sequences[field] for field in fields])
        self._arrays.update(zip(fields, arrays, strict=True))

    def __iter__(self) -> Iterator[str]:
        yield from self._sequences
        yield from (field for field in self._arrays if field not in self._sequences)

    def __len__(self) -> int:
        """Return the number of fields; `length` is the number of control steps."""
        return sum(1 for _ in self)

    def __contains__(self, field: object) -> bool:
        return field in self._sequences or field in self._arrays

    def __reduce__(self) -> tuple[type[Self], tuple[Any, ...]]:
        self.draw()
        return type(self), (dict(self), {}, self.length, self.actions[:0])

    def __repr__(self) -> str:
        fields = [
            f"{field} ({'' if field in self._arrays else 'not '}drawn)" for field in self._sequences
        ]
        fields += (field for field in self._arrays if field not in self._sequences)
        return f"<Video of {self.length} steps: {', '.join(fields)}>"


def make_video(
    episode: Episode,
    recording: Recording,
    spec: ObservationSpec,
    proprioception: Sequence[dict[str, Any]],
) -> DemonstrationVideo:
    """Return the video of a demonstration that has been played."""
    selection = spec.demonstration_frames
    every = selection if isinstance(selection, int) else 1
    sequences = {
        field: FrameSequence(episode, recording, field, kind, every, spec.rendering)
        for field, kind in picture_fields(spec).items()
        if selection != "none"
    }
    arrays = stack_proprioception(proprioception, spec)
    actions = recording.video_actions(episode)
    return DemonstrationVideo(arrays, sequences, len(proprioception), actions)
