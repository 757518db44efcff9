"""Objects in the front picture: their positions on the table, and what a detector would find.

A look is a moment at which the front picture is looked at, every eighth control step.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from roboirg.extension.sight import ExpertRecording, places_of, points_of
from roboirg_learn.policy.tracks import Detections

ROWS = (32, 160)
"""First and last row + 1 of the part of the picture that shows the table."""
COLUMNS = 256
"""Of the picture that trained detectors read, so no other size will do."""
NEAR_TOOL = 0.07
"""Meters in the plane from the tool within which the hand may hide an object."""
HIDDEN_LOOKS = 5
"""Looks in a block: an object that is missed, or a false positive, stays so for a whole block."""
FALSE_POSITIVE = -1
"""In the place of an object's number for a detection where no object is."""
POINT_NOISE = 0.7
"""Standard deviation of the points in the picture that a detector finds, pixels."""
YAW_NOISE = 0.2
"""Standard deviation of the angles that it finds, rad."""
MISS_RATE = 0.02
"""Mean probability that an object is not found; some objects are missed more often."""
MISS_RATE_NEAR_TOOL = 0.15
"""The same near the tool."""
FALSE_POSITIVE_RATE = 0.04
"""Probability that a block of looks has a false positive."""
UNKNOWN_CLASS = -1
"""In the place of a class number for a class that was not in the recordings learned from."""


class ObjectClasses(NamedTuple):
    """The classes of objects that a policy can see; a class number is an index into both fields.

    Attributes:
        names: such as ``"cube red"``, sorted.
        heights: (classes,) usual height of their origins above the table, m; a pixel is a position
            on the table only at a known height.
    """

    names: tuple[str, ...]
    heights: NDArray[np.float64]

    def class_numbers(self, names: Sequence[str]) -> NDArray[np.int64]:
        """Return the number of each class name, (n,); `UNKNOWN_CLASS` for one not in `names`.

        With the names ``("bin", "cube red")``, ``["cube red", "box"]`` → ``[1, -1]``.
        """
        number_of = {name: number for number, name in enumerate(self.names)}
        return np.array([number_of.get(name, UNKNOWN_CLASS) for name in names], np.int64)

    def table_positions(
        self, classes: NDArray[np.int64], points: NDArray[np.floating]
    ) -> NDArray[np.float32]:
        """Return where objects in a front picture stand on the table: x and y, m, (n, 2).

        Args:
            classes: (n,) class numbers, which give their heights.
            points: (n, 2) column and row in the picture, pixels.
        """
        return places_of(points, self.heights[classes])


def encode_yaws(angles: NDArray[np.floating]) -> NDArray[np.float32]:
    """Return yaw codes: cosine and sine (..., 2) of four times angles about the vertical, rad.

    A square looks the same after a quarter turn, and has the same code: 0 and π/2 → (1, 0).
    `moves.waypoint` decodes them.
    """
    return np.stack([np.cos(4.0 * angles), np.sin(4.0 * angles)], -1).astype(np.float32)


def object_classes_of(recorded: Iterable[ExpertRecording]) -> ObjectClasses:
    """Return the classes of objects that recordings show, each with its height on the table.

    The height is the median, over recordings, of that at the first look that shows an object:
    later it may be lifted.
    """
    heights: dict[str, list[float]] = {}
    for recording in recorded:
        for number, name in enumerate(recording.classes):
            is_visible = recording.visible[:, number]
            if is_visible.any():
                first_look = is_visible.argmax()
                height = recording.things[first_look, number, 2]
                heights.setdefault(name, []).append(float(height))
    names = tuple(sorted(heights))
    return ObjectClasses(names, np.array([np.median(heights[name]) for name in names]))


class LabeledDetections(NamedTuple):
    """What a detector might find at one look: n detections, each with the object that it is.

    Attributes:
        detections: class, position and angle of each.
        objects: (n,) the recording's number of the object that each is; `FALSE_POSITIVE` for none.
    """

    detections: Detections
    objects: NDArray[np.intp]


def labeled_looks(
    recorded: ExpertRecording, object_classes: ObjectClasses, rng: np.random.Generator
) -> Iterator[LabeledDetections]:
    """Yield what an imperfect detector might find at each look of a recording.

    It misses objects, errs a little about their positions and angles, and now and then has a false
    positive: a detection of any class at the position of an object. A network that learns from
    this tolerates such mistakes.
    """
    # All numbers are drawn here, in this order; the same generator gives the same mistakes.
    noisy = _draw_noisy_detections(recorded, object_classes, rng)
    noisy = _with_false_positives(noisy, len(object_classes.names), rng)
    last = noisy.classes.shape[1] - 1
    for look, is_found in enumerate(noisy.is_found):
        objects = np.flatnonzero(is_found)
        detections = Detections(
            noisy.classes[look, objects],
            noisy.positions[look, objects],
            noisy.yaw_codes[look, objects],
        )
        yield LabeledDetections(detections, np.where(objects == last, FALSE_POSITIVE, objects))


class _NoisyDetections(NamedTuple):
    """What a detector would find at T looks of K objects.

    Attributes:
        classes: (T, K) class numbers; meaningless where an object is not found.
        is_found: (T, K) whether it finds an object.
        positions: (T, K, 2) x and y where it finds it, m.
        yaw_codes: (T, K, 2) as `encode_yaws` returns them.
    """

    classes: NDArray[np.int64]
    is_found: NDArray[np.bool_]
    positions: NDArray[np.float32]
    yaw_codes: NDArray[np.float32]


def _draw_noisy_detections(
    recorded: ExpertRecording, object_classes: ObjectClasses, rng: np.random.Generator
) -> _NoisyDetections:
    """Draw what a detector would find: at which looks each object, and where, with errors.

    It finds what is visible, of a known class, on the table, and not missed by chance.
    """
    classes = object_classes.class_numbers(recorded.classes)
    positions = recorded.things[..., :3].astype(np.float64)
    is_found = _draw_is_not_missed(recorded, positions, rng)
    points = points_of(positions)
    is_found &= recorded.visible & (classes != UNKNOWN_CLASS) & _is_on_table(points)

    noisy_points = points + rng.normal(0.0, POINT_NOISE, points.shape)
    noisy_positions = _table_positions(noisy_points, classes, object_classes)
    angles = recorded.things[..., 3]
    yaw_codes = encode_yaws(angles + rng.normal(0.0, YAW_NOISE, angles.shape))
    classes_at_looks = np.broadcast_to(classes, is_found.shape)
    return _NoisyDetections(classes_at_looks, is_found, noisy_positions, yaw_codes)


def _draw_is_not_missed(
    recorded: ExpertRecording, positions: NDArray[np.float64], rng: np.random.Generator
) -> NDArray[np.bool_]:
    """Draw at which looks a detector does not miss each object: (looks, objects) bool.

    Args:
        recorded: with the tool's position at each look.
        positions: (looks, objects, 3) of the objects, m.
        rng: draws.
    """
    from_tool = positions[..., :2] - recorded.tool[:, None, :2]
    distances = np.hypot(from_tool[..., 0], from_tool[..., 1])
    miss_rates = np.where(distances < NEAR_TOOL, MISS_RATE_NEAR_TOOL, MISS_RATE)
    looks, objects = distances.shape
    # A detector has trouble with the same object again and again.
    miss_rates = miss_rates * rng.exponential(1.0, objects)
    # What hides an object does so for a while: one draw for each block of looks.
    drawn = rng.random((_block_count(looks), objects)).repeat(HIDDEN_LOOKS, axis=0)
    return drawn[:looks] >= miss_rates


def _is_on_table(points: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Return whether points are in the part of the front picture that shows the table: (...).

    Args:
        points: (..., 2) column and row, pixels.
    """
    low = np.array([0, ROWS[0]])
    high = np.array([COLUMNS, ROWS[1]])
    is_inside = (points >= low) & (points < high)
    return np.asarray(is_inside.all(-1))


def _table_positions(
    points: NDArray[np.float64], classes: NDArray[np.int64], object_classes: ObjectClasses
) -> NDArray[np.float32]:
    """Return x and y on the table, m, of objects at all looks: (looks, objects, 2).

    Args:
        points: (looks, objects, 2) column and row in the picture, pixels.
        classes: (objects,) class numbers; positions of `UNKNOWN_CLASS` mean nothing.
        object_classes: with the heights.
    """
    known_classes = np.maximum(classes, 0)
    class_of_each = np.broadcast_to(known_classes, points.shape[:2]).ravel()
    flat_positions = object_classes.table_positions(class_of_each, points.reshape(-1, 2))
    return flat_positions.reshape(points.shape)


def _with_false_positives(
    noisy: _NoisyDetections, class_count: int, rng: np.random.Generator
) -> _NoisyDetections:
    """Return detections of T looks with one more object at the end, which is not there: K + 1.

    In some blocks of looks it is found at the position of a real object wherever that is found; of
    which object, and as which class, is drawn for each block.

    Args:
        noisy: detections of K objects.
        class_count: number of classes.
        rng: draws.
    """
    looks, objects = noisy.is_found.shape
    blocks = _block_count(looks)
    is_there = rng.random(blocks) < FALSE_POSITIVE_RATE
    classes = rng.integers(0, class_count, blocks)
    hosts = rng.integers(0, objects, blocks)

    numbers = np.arange(looks)
    block = numbers // HIDDEN_LOOKS
    host = hosts[block]
    is_found = is_there[block] & noisy.is_found[numbers, host]
    return _NoisyDetections(
        np.column_stack([noisy.classes, classes[block]]),
        np.column_stack([noisy.is_found, is_found]),
        np.append(noisy.positions, noisy.positions[numbers, host][:, None], 1),
        np.append(noisy.yaw_codes, noisy.yaw_codes[numbers, host][:, None], 1),
    )


def _block_count(looks: int) -> int:
    """Return how many blocks of `HIDDEN_LOOKS` looks there are: 5 → 1, 6 → 2 (one shorter)."""
    return math.ceil(looks / HIDDEN_LOOKS)
