"""Select what a planner, or its policy, needs of the observations of an environment for both.

The environment shows what either needs: if the planner needs an observation every 2 control steps
and the policy one every 3, it keeps one at every step, of which each gets its own.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any, cast

from numpy.typing import NDArray

from roboirg.core.environment_options import DemonstrationFrames
from roboirg.core.observations import CAMERAS, Demonstration, Observation

PICTURE_FIELDS = tuple(f"{camera}_{kind}" for camera in CAMERAS for kind in ("rgb", "depth"))
"""Fields of a demonstration that may have only every n-th frame."""


class DemonstrationSubset(Mapping[str, NDArray[Any]]):
    """The fields of a demonstration with the frames that one of the two wants, rendered when read.

    Args:
        demonstration: of the environment.
        available: which frames it has: ``"all"``, every n-th, or ``"none"``.
        wanted: which frames to select, all or a multiple of those.
    """

    def __init__(
        self,
        demonstration: Demonstration,
        available: DemonstrationFrames,
        wanted: DemonstrationFrames,
    ) -> None:
        self._all = demonstration
        self._stride = max(_frames_between(wanted) // _frames_between(available), 1)

    def __getitem__(self, field: str) -> NDArray[Any]:
        """Return the entries of a field: of pictures the selected ones, of other fields all."""
        if field in PICTURE_FIELDS:
            return self._all[field][:: self._stride]
        return self._all[field][:]

    def __iter__(self) -> Iterator[str]:
        return iter(self._all)

    def __len__(self) -> int:
        """Return the number of fields."""
        return len(self._all)


def _frames_between(frames: DemonstrationFrames) -> int:
    """Return how far apart frames are: 1 for ``"all"``, 5 for every fifth; 1 for ``"none"``."""
    return 1 if frames in ("all", "none") else int(frames)


def select_history(
    observation: Observation, earlier: int, every: int | None, wanted: int | None
) -> Observation:
    """Return an observation with the part of its history that a planner, or its policy, wants.

    A history with an observation every 2 steps, of which one every 4 is wanted, keeps every second.

    Args:
        observation: of the environment; its history is what was observed since the last one.
        earlier: number of observations in the earlier histories of this episode.
        every: control steps between observations of the history; None without a history.
        wanted: control steps between the wanted ones, a multiple of `every`; None for no history.
    """
    if every is None or wanted == every:
        return observation
    selected: dict[str, Any] = dict(observation)
    history = selected.pop("history")
    if wanted is not None:
        stride = wanted // every
        chosen: list[Any] = []
        # The n-th observation of the episode is at step n * every.
        for number, past in enumerate(history, start=earlier + 1):
            if number % stride == 0:
                chosen.append(past)
        selected["history"] = tuple(chosen)
    return cast("Observation", selected)
