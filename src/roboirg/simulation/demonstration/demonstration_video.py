"""What a policy is shown before its turn: arrays; pictures among them are drawn when read."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from numpy.typing import NDArray

from roboirg.core.episode import Episode
from roboirg.simulation.demonstration.demonstration_frames import (
    DemonstrationFramesArray,
    read_frames,
)
from roboirg.simulation.demonstration.recording import Recording
from roboirg.simulation.observation_builder import (
    ObservationSpec,
    picture_space,
    stack_proprioception,
)


class DemonstrationVideo(Mapping[str, NDArray[Any]]):
    """A demonstration as a mapping from an observation's fields to arrays.

    Pictures are drawn when they are read for the first time, at any later moment, and then kept.
    Who wants more than one field of them calls `draw` first, which takes less time. A pickle
    holds all of them as a plain dictionary.

    Args:
        felt: the fields that are not drawn, with a leading axis T.
        frames: the fields that are drawn.
        length: control steps in the video, T.

    Attributes:
        length: control steps in the video, T.
    """

    def __init__(
        self,
        felt: Mapping[str, NDArray[Any]],
        frames: Mapping[str, DemonstrationFramesArray],
        length: int,
    ) -> None:
        self.length = length
        self._arrays = dict(felt)
        self._frames = dict(frames)

    def __getitem__(self, field: str) -> NDArray[Any]:
        """All of a field; KeyError if observations have no such field."""
        if field not in self._arrays:
            self._read((field,))
        return self._arrays[field]

    def draw(self) -> None:
        """Draw all pictures that have not been read yet, in one replay for all cameras."""
        self._read([field for field in self._frames if field not in self._arrays])

    def _read(self, fields: Sequence[str]) -> None:
        arrays = read_frames([self._frames[field] for field in fields])
        self._arrays.update(zip(fields, arrays, strict=True))

    def __iter__(self) -> Iterator[str]:
        yield from self._frames
        yield from (field for field in self._arrays if field not in self._frames)

    def __len__(self) -> int:
        """The number of fields, as of any mapping; of control steps: `length`."""
        return sum(1 for _ in self)

    def __contains__(self, field: object) -> bool:
        return field in self._frames or field in self._arrays

    def __reduce__(self) -> tuple[type[dict[str, Any]], tuple[dict[str, Any]]]:
        self.draw()
        return dict, (dict(self),)

    def __repr__(self) -> str:
        drawn = [
            f"{field} ({'' if field in self._arrays else 'not '}drawn)" for field in self._frames
        ]
        return f"<Video of {self.length} steps: {', '.join([*drawn, *self._felt()])}>"

    def _felt(self) -> list[str]:
        return [field for field in self._arrays if field not in self._frames]


def make_video(
    episode: Episode, recording: Recording, wishes: ObservationSpec, felt: Sequence[dict[str, Any]]
) -> DemonstrationVideo:
    """The video of a demonstration that has been played.

    Args:
        episode: whose demonstration.
        recording: what was done in it.
        wishes: which fields it has, and which pictures.
        felt: what was felt at each of its steps.
    """
    wish = wishes.demonstration_frames
    every = wish if isinstance(wish, int) else 1
    frames = {
        field: DemonstrationFramesArray(episode, recording, field, space, every, wishes.rendering)
        for field, space in picture_space(wishes).items()
        if wish != "none"
    }
    return DemonstrationVideo(stack_proprioception(felt, wishes), frames, len(felt))
