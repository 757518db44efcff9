"""What the front camera makes of a place, and back: where on the table a point of a picture is."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from roboirg.extension.sight import ExpertRecording, places_of, points_of
from roboirg_learn.policy.tracks import LookTokens

ROWS = (32, 160)
"""First and last row + 1 of the part of the picture that shows the table."""
COLUMNS = 256
"""Of the picture that trained detectors read, so no other size will do."""
NEAR_TOOL = 0.07
"""Meters in the plane from the tool within which the hand may hide a thing."""
HIDDEN_LOOKS = 5
"""Looks in a block: a thing that is lost, or a ghost, stays so for a whole block."""
GHOST = -1
"""In the place of an object's number for a ghost: a thing that is found but is not there."""
PLACE_NOISE = 0.7
"""Standard deviation of the places that a detector finds, pixels."""
TURN_NOISE = 0.2
"""Standard deviation of the angles that it finds, rad."""
LOST_RATE = 0.02
"""Mean probability that a thing is not found; some things are lost more often."""
LOST_RATE_NEAR_TOOL = 0.15
"""The same near the tool."""
GHOST_RATE = 0.04
"""Probability that a block of looks has a ghost."""


class Sight(NamedTuple):
    """Classes of things, and the height at which each stands on the table.

    Attributes:
        classes: names.
        heights: (classes,) of their origins, m.
    """

    classes: tuple[str, ...]
    heights: NDArray[np.float64]

    def kinds(self, names: Sequence[str]) -> NDArray[np.int64]:
        """Return the number of each class name, (n,); -1 for one that is not known."""
        numbers = {name: number for number, name in enumerate(self.classes)}
        return np.array([numbers.get(name, -1) for name in names], np.int64)

    def places(
        self, classes: NDArray[np.int64], points: NDArray[np.floating]
    ) -> NDArray[np.float32]:
        """Return where things in a front picture stand on the table: x and y, m, (n, 2).

        Args:
            classes: (n,) numbers of their classes, which give their heights.
            points: (n, 2) column and row in the picture, pixels.
        """
        return places_of(points, self.heights[classes])


def turns_of(angles: NDArray[np.floating]) -> NDArray[np.float32]:
    """Return cosine and sine (..., 2) of four times angles, rad.

    A square looks the same after a quarter turn, and so do these numbers.
    """
    return np.stack([np.cos(4.0 * angles), np.sin(4.0 * angles)], -1).astype(np.float32)


def sight_of(recorded: Iterable[ExpertRecording]) -> Sight:
    """Return the classes of things that episodes show, each with its height on the table.

    The height is the median, over episodes, of that at the first look that shows a thing: later it
    may be lifted.
    """
    heights: dict[str, list[float]] = {}
    for recording in recorded:
        for number, name in enumerate(recording.classes):
            is_visible = recording.visible[:, number]
            if is_visible.any():
                height = recording.things[is_visible.argmax(), number, 2]
                heights.setdefault(name, []).append(float(height))
    classes = tuple(sorted(heights))
    return Sight(classes, np.array([np.median(heights[name]) for name in classes]))


class LabeledLook(NamedTuple):
    """What a detector might find at a look.

    Attributes:
        tokens: the things.
        objects: the number of the object that each is; `GHOST` where there is none.
    """

    tokens: LookTokens
    objects: NDArray[np.intp]

    def with_ghost(
        self, kind: int, place: NDArray[np.float32], turn: NDArray[np.float32]
    ) -> LabeledLook:
        """Return the look with a thing added that is not there.

        Args:
            kind: number of its class.
            place: (2,) x and y, m.
            turn: (2,) as `turns_of` returns it.
        """
        tokens = LookTokens(
            np.append(self.tokens.classes, kind),
            np.vstack([self.tokens.places, place]),
            np.vstack([self.tokens.turns, turn]),
        )
        return LabeledLook(tokens, np.append(self.objects, GHOST))


def labeled_looks(
    recorded: ExpertRecording, sight: Sight, rng: np.random.Generator
) -> Iterator[LabeledLook]:
    """Yield what an imperfect detector might find at each look of a recording.

    A detector loses things, mistakes their places and angles a little, and now and then finds a
    ghost: a thing of any class at the place of another. The body learns from this, so that it
    bears such mistakes.
    """
    things = _draw_noisy_things(recorded, sight, rng)
    looks, objects = things.is_found.shape
    ghosts = _draw_ghosts(looks, objects, len(sight.classes), rng)
    for look in range(looks):
        labeled = things.at_look(look)
        block = look // HIDDEN_LOOKS
        host = ghosts.hosts[block]
        if ghosts.is_there[block] and things.is_found[look, host]:
            place = things.places[look, host]
            labeled = labeled.with_ghost(ghosts.kinds[block], place, things.turns[look, host])
        yield labeled


class _Ghosts(NamedTuple):
    """Things that are not there, one for each block of looks, if any.

    Attributes:
        is_there: whether there is one.
        kinds: the number of its class.
        hosts: the number of the object at whose place it is.
    """

    is_there: NDArray[np.bool_]
    kinds: NDArray[np.int64]
    hosts: NDArray[np.int64]


class _NoisyThings(NamedTuple):
    """What a detector would find of T looks at K objects.

    Attributes:
        kinds: (K,) numbers of classes.
        is_found: (T, K) whether it finds an object.
        places: (T, K, 2) x and y where it finds it, m.
        turns: (T, K, 2) as `turns_of` returns them.
    """

    kinds: NDArray[np.int64]
    is_found: NDArray[np.bool_]
    places: NDArray[np.float32]
    turns: NDArray[np.float32]

    def at_look(self, look: int) -> LabeledLook:
        """Return what is found at a look."""
        objects = np.flatnonzero(self.is_found[look])
        places = self.places[look, objects]
        tokens = LookTokens(self.kinds[objects], places, self.turns[look, objects])
        return LabeledLook(tokens, objects)


def _draw_noisy_things(
    recorded: ExpertRecording, sight: Sight, rng: np.random.Generator
) -> _NoisyThings:
    """Draw what a detector would find: at which looks each object, and where, with errors.

    It finds what is visible, of a learned class, on the table, and not lost by chance.
    """
    kinds = sight.kinds(recorded.classes)  # -1 for a class that is not learned
    positions = recorded.things[..., :3].astype(np.float64)
    is_found = _draw_is_not_lost(recorded, positions, rng)
    points = points_of(positions)
    is_found &= recorded.visible & (kinds >= 0) & _is_on_table(points)

    points += rng.normal(0.0, PLACE_NOISE, points.shape)
    places = _places_of(points, kinds, sight)
    angles = recorded.things[..., 3]
    turns = turns_of(angles + rng.normal(0.0, TURN_NOISE, angles.shape))
    return _NoisyThings(kinds, is_found, places, turns)


def _draw_is_not_lost(
    recorded: ExpertRecording, positions: NDArray[np.float64], rng: np.random.Generator
) -> NDArray[np.bool_]:
    """Draw at which looks a detector does not lose each object: True, (looks, objects).

    Args:
        recorded: with the tool's place at each look.
        positions: (looks, objects, 3) of the objects, m.
        rng: draws.
    """
    from_tool = positions[..., :2] - recorded.tool[:, None, :2]
    distances = np.hypot(from_tool[..., 0], from_tool[..., 1])
    probabilities = np.where(distances < NEAR_TOOL, LOST_RATE_NEAR_TOOL, LOST_RATE)
    looks, objects = distances.shape
    # A detector has trouble with the same thing again and again.
    probabilities = probabilities * rng.exponential(1.0, objects)
    # What hides a thing does so for a while: one draw for each block of looks.
    drawn = rng.random((_block_count(looks), objects)).repeat(HIDDEN_LOOKS, axis=0)
    return drawn[:looks] >= probabilities


def _is_on_table(points: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Return whether points of a picture are in the part that shows the table.

    Args:
        points: (..., 2) column and row, pixels.
    """
    low = np.array([0, ROWS[0]])
    high = np.array([COLUMNS, ROWS[1]])
    is_inside = (points >= low) & (points < high)
    return is_inside[..., 0] & is_inside[..., 1]


def _places_of(
    points: NDArray[np.float64], kinds: NDArray[np.int64], sight: Sight
) -> NDArray[np.float32]:
    """Return x and y on the table, m, of objects at all looks: (looks, objects, 2).

    Args:
        points: (looks, objects, 2) column and row in the picture, pixels.
        kinds: (objects,) numbers of classes; the place of one with -1 means nothing.
        sight: knows the heights.
    """
    known_kinds = np.maximum(kinds, 0)  # the others are not found
    kind_of_each = np.broadcast_to(known_kinds, points.shape[:2]).ravel()
    return sight.places(kind_of_each, points.reshape(-1, 2)).reshape(points.shape)


def _draw_ghosts(looks: int, objects: int, classes: int, rng: np.random.Generator) -> _Ghosts:
    """Draw a ghost for each block of looks; most have none."""
    blocks = _block_count(looks)
    return _Ghosts(
        is_there=rng.random(blocks) < GHOST_RATE,
        kinds=rng.integers(0, classes, blocks),
        hosts=rng.integers(0, objects, blocks),
    )


def _block_count(looks: int) -> int:
    """Return how many blocks of `HIDDEN_LOOKS` looks there are, the last one maybe shorter."""
    return math.ceil(looks / HIDDEN_LOOKS)
