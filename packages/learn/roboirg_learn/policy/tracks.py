"""Multi-object tracking: detections are followed from look to look.

So what is remembered of an object stays with it. A look is a moment at which the front picture is
looked at; a track is an object that is followed, known by its number.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment

MOST_TRACKS = 24
MAX_JUMP = 0.4
"""Most meters between where an object is expected and where it is found: the hand moves fast."""
CONFIRMING_LOOKS = 3
"""Looks that must show an object before its track is confirmed; fewer in the first looks."""
OTHER_CLASS_DISTANCE = 10.0
"""Meters that count between objects of different classes: more than any jump, so never paired."""
NO_TRACK = -1
"""In the place of a track's number for a detection that has none."""


class Detections(NamedTuple):
    """The n objects found at one look.

    Attributes:
        classes: (n,) class numbers, indices into `ObjectClasses`.
        positions: (n, 2) x and y on the table, m.
        yaw_codes: (n, 2) cosine and sine of four times the angle about the vertical, as
            `encode_yaws` returns them.
    """

    classes: NDArray[np.int64]
    positions: NDArray[np.float32]
    yaw_codes: NDArray[np.float32]


class Tracker:
    """Follows the objects of one episode; keeps the latest of each track.

    Arrays have a row for each track: the row's index is the track's number, which never changes.
    `update` changes all of them.

    Attributes:
        count: number of tracks so far; the rows after theirs are empty.
        classes: (MOST_TRACKS,) the class number of each.
        positions: (MOST_TRACKS, 2) x and y where each was last seen, m.
        yaw_codes: (MOST_TRACKS, 2) how each was last seen to be turned; see `Detections`.
        visible: (MOST_TRACKS,) whether the last look shows each.
    """

    def __init__(self) -> None:
        self.count = 0
        self.classes = np.zeros(MOST_TRACKS, np.int64)
        self.positions = np.zeros((MOST_TRACKS, 2), np.float32)
        self.yaw_codes = np.zeros((MOST_TRACKS, 2), np.float32)
        self._velocities = np.zeros((MOST_TRACKS, 2), np.float32)
        self.visible = np.zeros(MOST_TRACKS, bool)
        self._looks_seen = np.zeros(MOST_TRACKS, np.int64)
        self._looks = 0

    @property
    def confirmed(self) -> NDArray[np.bool_]:
        """Whether each was seen often enough to be no mistake of the detector (MOST_TRACKS,)."""
        return self._looks_seen >= min(self._looks, CONFIRMING_LOOKS)

    def update(self, look: Detections) -> NDArray[np.int64]:
        """Match the detections of a new look with the tracks, and bring those up to date.

        Returns the number of the track of each detection, (n,): a new one for an object that is
        seen first, `NO_TRACK` where `MOST_TRACKS` are used up.
        """
        tracks = self._match(look)
        # Before positions and visibility change: velocities are since the last look.
        self._set_velocities(look, tracks)
        new_objects = np.flatnonzero(tracks == NO_TRACK)[: MOST_TRACKS - self.count]
        tracks[new_objects] = self.count + np.arange(len(new_objects))
        self.count += len(new_objects)

        is_tracked = tracks != NO_TRACK
        shown = tracks[is_tracked]
        self.visible[:] = False
        self.visible[shown] = True
        self.classes[shown] = look.classes[is_tracked]
        self.positions[shown] = look.positions[is_tracked]
        self.yaw_codes[shown] = look.yaw_codes[is_tracked]
        self._looks_seen[shown] += 1
        self._looks += 1
        return tracks

    def _set_velocities(self, look: Detections, tracks: NDArray[np.int64]) -> None:
        """Set how each track has moved since the last look, m; 0 unless both looks show it.

        Args:
            look: the new look.
            tracks: (n,) the track of each of its detections; `NO_TRACK` for a new object.
        """
        is_old = tracks != NO_TRACK
        old = tracks[is_old]
        moved = look.positions[is_old] - self.positions[old]
        self._velocities[:] = 0.0
        self._velocities[old] = np.where(self.visible[old, None], moved, 0.0)

    def _match(self, look: Detections) -> NDArray[np.int64]:
        """Return the track of each detection of a look, (n,); `NO_TRACK` for one that fits none.

        Detections are paired with tracks of their class (Hungarian algorithm) so that the sum of
        all distances to where the tracks are expected is least; a track is expected to go on
        moving. Pairs farther apart than `MAX_JUMP` are dropped.
        """
        matched = np.full(len(look.classes), NO_TRACK, np.int64)
        if not self.count or not len(matched):
            return matched
        expected = (self.positions + self._velocities)[: self.count]
        offsets = look.positions[:, None] - expected
        distances = np.hypot(offsets[..., 0], offsets[..., 1])  # (n, tracks)
        is_other_class = look.classes[:, None] != self.classes[: self.count]
        distances[is_other_class] = OTHER_CLASS_DISTANCE
        detections, tracks = linear_sum_assignment(np.minimum(distances, OTHER_CLASS_DISTANCE))
        is_near = distances[detections, tracks] <= MAX_JUMP
        matched[detections[is_near]] = tracks[is_near]
        return matched
