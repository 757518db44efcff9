"""Follow things from look to look, so that what is remembered of one stays with it."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment

MOST_TRACKS = 24
MAX_JUMP = 0.4
"""Meters from where a thing is expected at which it may be, at most: the hand moves fast."""
CONFIRMING_LOOKS = 3
"""Looks in which a thing must be seen, once there were as many."""
OTHER_CLASS_DISTANCE = 10.0
"""Meters that a thing of another class counts as."""


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
    """What is known of each thing that was ever seen; a thing stays in its class.

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
        """Take in a look; returns the track of each of its things, -1 beyond the most tracks."""
        tracks = self._assign(look)
        self._follow(look, tracks)
        new = np.flatnonzero(tracks < 0)[: MOST_TRACKS - self.count]
        tracks[new] = self.count + np.arange(len(new))
        self.count += len(new)

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
        """Note how far things have moved that the last look showed, too."""
        is_old = tracks >= 0
        old = tracks[is_old]
        way = look.places[is_old] - self.places[old]
        self._speeds[:] = 0.0
        self._speeds[old] = np.where(self.seen[old, None], way, 0.0)

    def _assign(self, look: LookTokens) -> NDArray[np.int64]:
        """Return the track of each thing, -1 for a new one; pairs are nearest in all."""
        found = np.full(len(look.classes), -1, np.int64)
        if not self.count or not len(found):
            return found
        expected = (self.places + self._speeds)[: self.count]
        away = look.places[:, None] - expected
        distances = np.hypot(away[..., 0], away[..., 1])
        is_other_class = look.classes[:, None] != self.classes[: self.count]
        distances[is_other_class] = OTHER_CLASS_DISTANCE
        things, tracks = linear_sum_assignment(np.minimum(distances, OTHER_CLASS_DISTANCE))
        is_near = distances[things, tracks] <= MAX_JUMP
        found[things[is_near]] = tracks[is_near]
        return found
