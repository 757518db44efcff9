"""Follow things from look to look, so that what is remembered of one stays with it."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment

MOST_TRACKS = 24
MAX_JUMP = 0.4
"""Most meters between where a thing is expected and where it is found: the hand moves fast."""
CONFIRMING_LOOKS = 3
"""Looks that must show a thing before it counts as known; fewer in the first looks."""
OTHER_CLASS_DISTANCE = 10.0
"""Meters that count between things of different classes: more than any jump, so never paired."""


class LookTokens(NamedTuple):
    """The things found at one look.

    Attributes:
        classes: (n,) numbers of classes, from 0.
        places: (n, 2) x and y on the table, m.
        turns: (n, 2) cosine and sine of four times the angle about the vertical.
    """

    classes: NDArray[np.int64]
    places: NDArray[np.float32]
    turns: NDArray[np.float32]


class Tracks:
    """What is known of each thing that was ever seen; a track is such a thing, by its number.

    Attributes:
        count: number of things; the rows after theirs are empty.
        classes: (MOST_TRACKS,) the class of each.
        places: (MOST_TRACKS, 2) where each was last seen, m.
        turns: (MOST_TRACKS, 2) how each was last seen to be turned; see `LookTokens`.
        seen: (MOST_TRACKS,) whether the last look shows each.
    """

    def __init__(self) -> None:
        self.count = 0
        self.classes = np.zeros(MOST_TRACKS, np.int64)
        self.places = np.zeros((MOST_TRACKS, 2), np.float32)
        self.turns = np.zeros((MOST_TRACKS, 2), np.float32)
        self._speeds = np.zeros((MOST_TRACKS, 2), np.float32)
        self.seen = np.zeros(MOST_TRACKS, bool)
        self._looks_seen = np.zeros(MOST_TRACKS, np.int64)
        self._looks = 0

    @property
    def known(self) -> NDArray[np.bool_]:
        """Whether each was seen often enough to be no mistake of the detector (MOST_TRACKS,)."""
        return self._looks_seen >= min(self._looks, CONFIRMING_LOOKS)

    def update(self, look: LookTokens) -> NDArray[np.int64]:
        """Match the things of a new look with the tracks, and bring those up to date.

        Returns the number of the track of each thing, (n,): a new one for a thing that is seen
        first, -1 where `MOST_TRACKS` are used up.
        """
        tracks = self._assign(look)
        self._follow(look, tracks)
        new_things = np.flatnonzero(tracks < 0)[: MOST_TRACKS - self.count]
        tracks[new_things] = self.count + np.arange(len(new_things))
        self.count += len(new_things)

        is_tracked = tracks >= 0
        shown = tracks[is_tracked]
        self.seen[:] = False
        self.seen[shown] = True
        self.classes[shown] = look.classes[is_tracked]
        self.places[shown] = look.places[is_tracked]
        self.turns[shown] = look.turns[is_tracked]
        self._looks_seen[shown] += 1
        self._looks += 1
        return tracks

    def _follow(self, look: LookTokens, tracks: NDArray[np.int64]) -> None:
        """Set the speed of each track: meters since the last look; 0 unless both looks show it.

        Args:
            look: the new look.
            tracks: (n,) the track of each of its things; -1 for a new thing.
        """
        is_old = tracks >= 0
        old = tracks[is_old]
        moved = look.places[is_old] - self.places[old]
        self._speeds[:] = 0.0
        self._speeds[old] = np.where(self.seen[old, None], moved, 0.0)

    def _assign(self, look: LookTokens) -> NDArray[np.int64]:
        """Return the track of each thing of a look, (n,); -1 for a thing that fits none.

        Things are paired with tracks of their class so that the sum of all distances to where the
        tracks are expected is least; pairs farther apart than `MAX_JUMP` are dropped.
        """
        found = np.full(len(look.classes), -1, np.int64)
        if not self.count or not len(found):
            return found
        expected = (self.places + self._speeds)[: self.count]
        offsets = look.places[:, None] - expected
        distances = np.hypot(offsets[..., 0], offsets[..., 1])
        is_other_class = look.classes[:, None] != self.classes[: self.count]
        distances[is_other_class] = OTHER_CLASS_DISTANCE
        things, tracks = linear_sum_assignment(np.minimum(distances, OTHER_CLASS_DISTANCE))
        is_near = distances[things, tracks] <= MAX_JUMP
        found[things[is_near]] = tracks[is_near]
        return found
