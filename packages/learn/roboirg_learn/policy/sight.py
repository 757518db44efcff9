"""What the front camera makes of a place, and back: where on the table a point of a picture is."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from roboirg.extension.sight import ExpertRecording, places_of, points_of
from roboirg_learn.policy.tracks import LookTokens

ROWS = (32, 160)
"""First and last row + 1 of the part of the picture that shows the table."""
COLUMNS = 256
"""Of the picture."""
NEAR_TOOL = 0.07
"""Meters in the plane from the tool within which the hand may hide a thing."""
HIDDEN_LOOKS = 5
"""Looks for which a thing that is lost stays lost, and what is not there is found."""
GHOST = -1
"""Number of the object where none is."""
PLACE_NOISE, TURN_NOISE = 0.7, 0.2
"""Standard deviations of what a detector finds: of a place, pixels, and of the angle, rad."""
LOST, LOST_NEAR_TOOL = 0.02, 0.15
"""Mean probability that a thing is not found; some things are lost more often."""
GHOST_RATE = 0.04
"""Probability that something is found that is not there, where something else is."""


class Sight(NamedTuple):
    """Classes of things, and the height at which each stands on the table.

    Attributes:
        classes: names.
        heights: (classes,) of their origins, m.
    """

    classes: tuple[str, ...]
    heights: NDArray[np.float64]

    def kinds(self, names: Sequence[str]) -> NDArray[np.int64]:
        """Return the numbers of classes; -1 for one that is not known."""
        numbers = {name: number for number, name in enumerate(self.classes)}
        return np.array([numbers.get(name, -1) for name in names], np.int64)

    def places(
        self, classes: NDArray[np.int64], points: NDArray[np.floating]
    ) -> NDArray[np.float32]:
        """Return x and y (n, 2), m, of points (n, 2), column and row, of things on the table."""
        return places_of(points, self.heights[classes])


def turns_of(angles: NDArray[np.floating]) -> NDArray[np.float32]:
    """Return cosine and sine (..., 2) of four times angles, rad, which a square has four of."""
    return np.stack([np.cos(4.0 * angles), np.sin(4.0 * angles)], -1).astype(np.float32)


def sight_of(recorded: Iterable[ExpertRecording]) -> Sight:
    """Return the classes of things that episodes show, each with its height when first seen."""
    found: dict[str, list[float]] = {}
    for one in recorded:
        for number in np.flatnonzero(one.visible.any(axis=0)):
            first = int(one.visible[:, number].argmax())
            found.setdefault(one.classes[number], []).append(float(one.things[first, number, 2]))
    classes = tuple(sorted(found))
    return Sight(classes, np.array([np.median(found[name]) for name in classes]))


def labeled_looks(
    recorded: ExpertRecording, sight: Sight, rng: np.random.Generator
) -> Iterator[tuple[LookTokens, NDArray[np.intp]]]:
    """Yield what a detector might find at each look, and the numbers of the objects found.

    An object that is found by mistake has the number `GHOST`.
    """
    kinds = sight.kinds(recorded.classes)
    positions = recorded.things[..., :3].astype(np.float64)
    away = np.hypot(*np.moveaxis(positions[..., :2] - recorded.tool[:, None, :2], -1, 0))
    lost = np.where(away < NEAR_TOOL, LOST_NEAR_TOOL, LOST)
    # A detector has trouble with the same thing again and again.
    lost = lost * rng.exponential(1.0, lost.shape[1])
    points = points_of(positions)
    # What hides a thing does so for a while.
    blocks = -(-len(lost) // HIDDEN_LOOKS)
    drawn = rng.random((blocks, lost.shape[1])).repeat(HIDDEN_LOOKS, axis=0)[: len(lost)]
    found = recorded.visible & (drawn >= lost) & (kinds >= 0)
    low, high = np.array([0, ROWS[0]]), np.array([COLUMNS, ROWS[1]])
    found &= ((points >= low) & (points < high)).all(axis=-1)
    points += rng.normal(0.0, PLACE_NOISE, points.shape)
    shape = points.shape[:2]
    every = np.broadcast_to(np.maximum(kinds, 0), shape).ravel()
    places = sight.places(every, points.reshape(-1, 2)).reshape(*shape, 2)
    turns = turns_of(recorded.things[..., 3] + rng.normal(0.0, TURN_NOISE, shape))
    is_ghost = rng.random(blocks) < GHOST_RATE
    ghosts = rng.integers(0, len(sight.classes), blocks)
    hosts = rng.integers(0, shape[1], blocks)
    for look, shown in enumerate(found):
        block = look // HIDDEN_LOOKS
        objects = at = np.flatnonzero(shown)
        own = kinds[at]
        if is_ghost[block] and shown[hosts[block]]:
            at, own = np.append(at, hosts[block]), np.append(own, ghosts[block])
            objects = np.append(objects, GHOST)
        yield LookTokens(own, places[look, at], turns[look, at]), objects
