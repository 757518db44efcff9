"""Select what a planner or its policy needs of an environment that serves both."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any, cast

from numpy.typing import NDArray

from roboirg.core.environment_options import DemonstrationFrames
from roboirg.core.observations import CAMERAS, Demonstration, Observation

PICTURE_FIELDS = tuple(f"{camera}_{kind}" for camera in CAMERAS for kind in ("rgb", "depth"))
"""Fields of a demonstration that may have only every n-th frame."""


class DemonstrationSubset(Mapping[str, NDArray[Any]]):
    """The frames of a demonstration that one of the two wants; rendered only when read.

    Args:
        demonstration: of the environment.
        available: its frames.
        wanted: the frames to select.
    """

    def __init__(
        self,
        demonstration: Demonstration,
        available: DemonstrationFrames,
        wanted: DemonstrationFrames,
    ) -> None:
        own, other = (1 if one in ("all", "none") else int(one) for one in (wanted, available))
        self._all = demonstration
        self._stride = max(own // other, 1)

    def __getitem__(self, field: str) -> NDArray[Any]:
        """Return the selected entries of a field."""
        return self._all[field][:: self._stride if field in PICTURE_FIELDS else 1]

    def __iter__(self) -> Iterator[str]:
        return iter(self._all)

    def __len__(self) -> int:
        """Return the number of fields."""
        return len(self._all)


def select_history(
    observation: Observation, earlier: int, every: int | None, wanted: int | None
) -> Observation:
    """Return an observation with the part of its history that one of the two wants.

    Args:
        observation: of the environment.
        earlier: observations in the earlier histories of this episode.
        every: control steps between observations of the history.
        wanted: control steps between the wanted ones, a multiple of `every`; None for no history.
    """
    if every is None or wanted == every:
        return observation
    selected = {name: value for name, value in observation.items() if name != "history"}
    if wanted is not None:
        stride = wanted // every
        # Observations are taken at multiples of the period, counted from the start of the turn.
        numbered = enumerate(observation["history"], start=earlier + 1)
        selected["history"] = tuple(one for number, one in numbered if number % stride == 0)
    return cast("Observation", selected)
