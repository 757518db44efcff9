"""Two who look through one environment: what both get to see, and what is cut for each of them."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import Any, cast

from numpy.typing import NDArray

from roboirg.core.observations import CAMERAS, Demonstration, DemonstrationFrames, Observation

DRAWN = tuple(f"{camera}_{kind}" for camera in CAMERAS for kind in ("rgb", "depth"))
"""Fields of a demonstration of which every n-th entry may be asked for."""


def both_cameras(one: tuple[str, ...], other: tuple[str, ...]) -> tuple[str, ...]:
    """The cameras that either of them wants."""
    return tuple(camera for camera in CAMERAS if camera in (*one, *other))


def both_frames(one: DemonstrationFrames, other: DemonstrationFrames) -> DemonstrationFrames:
    """The pictures of the video in which each of them finds what it wants."""
    wishes = [1 if wish == "all" else int(wish) for wish in (one, other) if wish != "none"]
    if not wishes:
        return "none"
    every = math.gcd(*wishes)
    return "all" if every == 1 else every


def both_histories(one: int | None, other: int | None) -> int | None:
    """After how many steps to look, so that each of them sees what it wants."""
    wishes = [wish for wish in (one, other) if wish is not None]
    return math.gcd(*wishes) if wishes else None


class DemonstrationSubset(Mapping[str, NDArray[Any]]):
    """A demonstration as one of the two wants it; still drawn only when it is read.

    Args:
        demonstration: what the environment shows.
        drawn: which pictures that has.
        wanted: which pictures this one wants.
    """

    def __init__(
        self, demonstration: Demonstration, drawn: DemonstrationFrames, wanted: DemonstrationFrames
    ) -> None:
        self._all = demonstration
        self._hidden = DRAWN if wanted == "none" else ()
        have, want = (1 if wish in ("all", "none") else int(wish) for wish in (drawn, wanted))
        self._stride = want // have

    def __getitem__(self, field: str) -> NDArray[Any]:
        """The field's entries that are wanted; KeyError if there are none."""
        if field in self._hidden:
            raise KeyError(field)
        held = self._all[field]
        return held[:: self._stride] if field in DRAWN and self._stride > 1 else held

    def __iter__(self) -> Iterator[str]:
        return (field for field in self._all if field not in self._hidden)

    def __len__(self) -> int:
        """The number of fields."""
        return sum(1 for _ in self)


def cut_history(
    observation: Observation, looked: int, every: int | None, wanted: int | None
) -> Observation:
    """An observation with as much of its history as one of the two wants.

    Args:
        observation: what the environment shows.
        looked: how many looks of earlier histories there were in this episode.
        every: control steps between looks.
        wanted: control steps between the looks that are wanted, a multiple; None for none at all.
    """
    if every is None or wanted == every:
        return observation
    cut = {name: held for name, held in observation.items() if name != "history"}
    if wanted is not None:
        due = wanted // every
        # Looks are taken at multiples of the period, counted from the beginning of the turn.
        looks = enumerate(observation["history"], start=looked + 1)
        cut["history"] = tuple(look for number, look in looks if number % due == 0)
    return cast("Observation", cut)
