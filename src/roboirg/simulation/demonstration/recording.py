"""What the oracle did in a demonstration, as plain data that replays to the same bits."""

from __future__ import annotations

import io
from collections.abc import Iterator
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from roboirg.core.episode import Episode


class Move(NamedTuple):
    """One control step of a demonstration.

    Attributes:
        stage: index of the demonstration's stage that the hands were doing.
        action: (8,) joint targets (rad) and the gripper.
    """

    stage: int
    action: NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Recording:
    """A demonstration that has been played.

    Attributes:
        actions: (n, 8) joint targets (rad) and the gripper; the step at home that follows every
            demonstration is not among them.
        stages: (n,) index of the demonstration's stage that each belongs to.
        end: hash of the state after the step at home, in hexadecimal.
    """

    actions: NDArray[np.float64]
    stages: NDArray[np.uint8]
    end: str

    @classmethod
    def of(cls, moves: list[Move], end: str) -> Recording:
        """From what was done, step by step."""
        actions = np.array([move.action for move in moves], dtype=np.float64).reshape(-1, 8)
        return cls(actions, np.array([move.stage for move in moves], dtype=np.uint8), end)

    def moves(self) -> Iterator[Move]:
        """What was done, step by step."""
        for stage, action in zip(self.stages, self.actions, strict=True):
            yield Move(int(stage), action)

    def length_of_video(self, episode: Episode) -> int:
        """How many of the steps are in the episode's video."""
        recorded = np.array([stage.recorded for stage in episode.demonstration], dtype=bool)
        return int(np.count_nonzero(recorded[self.stages])) if len(recorded) else 0

    def encoded(self) -> bytes:
        """As bytes; no bit is lost."""
        file = io.BytesIO()
        np.savez_compressed(file, actions=self.actions, stages=self.stages, end=np.array(self.end))
        return file.getvalue()

    @classmethod
    def decoded(cls, content: bytes | memoryview) -> Recording:
        """From what `encoded` gave."""
        with np.load(io.BytesIO(content), allow_pickle=False) as arrays:
            return cls(arrays["actions"], arrays["stages"], str(arrays["end"]))
