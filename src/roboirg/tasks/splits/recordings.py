"""RoboMME's own videos of three tasks, as the actions that its planner gave.

``recordings/TASK-SPLIT.npz`` holds for episode N ``actions_N``, float32 (n, 8), and ``stages_N``,
uint8 (n,), made by ``scripts/convert_robomme_episodes.py`` (Apache-2.0, see NOTICE).
"""

from __future__ import annotations

import functools
import re
import zipfile
from importlib import resources
from importlib.resources.abc import Traversable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

FOLDER = "recordings"
_MEMBER = re.compile(r"actions_(\d+)\.npy")
"""The file with the actions of an episode in a recording; group 1 is the episode."""


class RecordedActions(NamedTuple):
    """What the robot does in a video, without the step at home that follows it.

    Attributes:
        actions: (n, 8) absolute joint targets, rad, and the gripper, +1 open, -1 closed.
        stages: (n,) index of the demonstration's stage of each; the last one is not in the video.
    """

    actions: NDArray[np.float64]
    stages: NDArray[np.uint8]


def is_recorded(task: str, split: str, index: int) -> bool:
    """Return whether the recording of an episode's video is shipped.

    None is shipped for tasks whose robot rests in the video, for episodes that RoboMME does not
    have, and for four whose recording does not complete the video's stages.
    """
    return index in _recorded_indices(task, split)


def recorded_actions(task: str, split: str, index: int) -> RecordedActions:
    """Return the recording of an episode's video; it must have one, see `is_recorded`."""
    if not is_recorded(task, split, index):
        raise KeyError(f"{task}/{split}/{index}")
    with _file(task, split).open("rb") as opened, np.load(opened) as arrays:
        actions = arrays[f"actions_{index}"]
        stages = arrays[f"stages_{index}"]
        return RecordedActions(actions.astype(np.float64), stages)


def _file(task: str, split: str) -> Traversable:
    """Return the place of a split's archive, ``VideoRepick-train.npz``; there need not be one."""
    return resources.files("roboirg.tasks.splits").joinpath(FOLDER, f"{task}-{split}.npz")


@functools.cache
def _recorded_indices(task: str, split: str) -> frozenset[int]:
    """Return the numbers of the episodes of a split whose recordings are shipped.

    They follow from the names of the files in the archive, such as ``actions_7.npy`` for 7.
    """
    file = _file(task, split)
    if not file.is_file():
        return frozenset()
    indices = set()
    with file.open("rb") as opened, zipfile.ZipFile(opened) as archive:
        for member in archive.namelist():
            found = _MEMBER.match(member)
            if found is not None:
                indices.add(int(found[1]))
    return frozenset(indices)
