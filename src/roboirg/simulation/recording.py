"""Recordings of demonstrations: plain data that replays exactly, bit for bit."""

from __future__ import annotations

import io
from collections.abc import Iterator
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from roboirg.core.actions import JOINT_ANGLE, CheckedActions
from roboirg.core.episode import Episode
from roboirg.core.observations import DemonstrationSource


class RecordedStep(NamedTuple):
    """One control step of a demonstration.

    Attributes:
        stage: index of the demonstration's stage being executed.
        action: (8,) joint targets (rad) and the gripper.
    """

    stage: int
    action: CheckedActions


@dataclass(frozen=True, eq=False)
class Recording:
    """The recorded actions of a demonstration.

    Attributes:
        actions: (n, 8) joint targets (rad) and the gripper, without the step at home that follows
            every demonstration.
        stages: (n,) index of each action's stage in the demonstration.
        end: hash of the state after the step at home, in hexadecimal.
        source: where the actions come from.
    """

    actions: CheckedActions
    stages: NDArray[np.uint8]
    end: str
    source: DemonstrationSource = "planned"

    @classmethod
    def from_steps(cls, steps: list[RecordedStep], end: str) -> Recording:
        """Create a recording from its steps and the state hash at the end."""
        actions = np.array([step.action for step in steps], dtype=np.float64)
        stages = np.array([step.stage for step in steps], dtype=np.uint8)
        return cls(actions.reshape(-1, JOINT_ANGLE.size), stages, end)

    def steps(self) -> Iterator[RecordedStep]:
        """Yield the recorded steps."""
        for stage, action in zip(self.stages, self.actions, strict=True):
            yield RecordedStep(int(stage), action)

    def video_actions(self, episode: Episode) -> CheckedActions:
        """Return the actions (T, 8) of the steps in the episode's video."""
        if not episode.demonstration:
            return self.actions[:0]
        is_shown = np.array([stage.in_video for stage in episode.demonstration], dtype=bool)
        shown: CheckedActions = self.actions[is_shown[self.stages]]
        return shown

    def video_length(self, episode: Episode) -> int:
        """Return the number of steps in the episode's video."""
        return len(self.video_actions(episode))

    def to_bytes(self) -> bytes:
        """Serialize without loss, as an NPZ file; `source` is not kept."""
        file = io.BytesIO()
        end = np.array(self.end)
        np.savez_compressed(file, actions=self.actions, stages=self.stages, end=end)
        return file.getvalue()

    @classmethod
    def from_bytes(cls, content: bytes | memoryview) -> Recording:
        """Deserialize the output of `to_bytes`."""
        with np.load(io.BytesIO(content), allow_pickle=False) as arrays:
            return cls(arrays["actions"], arrays["stages"], str(arrays["end"]))
