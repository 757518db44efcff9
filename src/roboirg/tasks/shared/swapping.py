"""Plan swaps: objects that change places two at a time, one swap after the other."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterable, Sequence

from roboirg.core.episode import Scene, SceneObject
from roboirg.core.motions import Motion, Point, Swap

SWAP_STEPS = 50
"""Control steps of one swap (RoboMME)."""
SWAP_START = 1
"""Control steps from the beginning of the video's holding stage to its first swap (RoboMME)."""


def plan_swaps(
    objects: Sequence[SceneObject],
    initiators: Sequence[str],
    *,
    start: int,
    lane: float,
    stage: int | None = None,
    partners: Sequence[str | None] = (),
) -> tuple[Swap, ...]:
    """Plan that each initiator in turn changes places with the object then nearest to it.

    *Then* is after the swaps before it. The first swap begins at `start`, the second `SWAP_STEPS`
    later, and so on.

    Args:
        objects: all possible partners; those that do not move are pinned meanwhile.
        initiators: names of the objects that start a swap, in order.
        start: step of the first swap; the others follow without a pause.
        lane: sideways swing, m.
        stage: index of the demonstration's stage from which `start` counts; None: from reset.
        partners: names of those with whom the first initiators change places instead; None where
            that is not known. At most as many as `initiators`.
    """
    places = {item.name: item.position for item in objects}
    swaps = []
    for first, partner in itertools.zip_longest(initiators, partners):
        second = partner or nearest(places, first)
        others = [name for name in places if name not in (first, second)]
        swap = Swap(
            first,
            second,
            start=start,
            steps=SWAP_STEPS,
            lane=lane,
            pinned=tuple(others),
            stage=stage,
        )
        swaps.append(swap)
        # The next one starts when this one is complete, from the new places.
        _exchange(places, swap)
        start += SWAP_STEPS
    return tuple(swaps)


def places_at_last(scene: Scene) -> dict[str, Point]:
    """Return where each object of a scene stands after all of its swaps, by name.

    Swaps are applied in the scene's order; the scene itself is not changed.
    """
    places = {item.name: item.position for item in scene.objects}
    for swap in scene.motions_of(Swap):
        _exchange(places, swap)
    return places


def _exchange(places: dict[str, Point], swap: Swap) -> None:
    """Give the two objects of a swap each other's places, by changing `places`."""
    place = places[swap.first]
    places[swap.first] = places[swap.second]
    places[swap.second] = place


def last_step(motions: Iterable[Motion]) -> int:
    """Return the control step at which the last swap is complete; 0 if no motion is a swap."""
    last = 0
    for motion in motions:
        if isinstance(motion, Swap):
            last = max(last, motion.start + motion.steps)
    return last


def nearest(places: dict[str, Point], name: str) -> str:
    """Return the name of the object nearest to the named one, by distance in the plane.

    `places` has all objects' places by name. Of two at the same distance, the first is returned.
    """
    here = places[name]

    def distance(other: str) -> float:
        there = places[other]
        return math.hypot(there.x - here.x, there.y - here.y)

    others = [other for other in places if other != name]
    return min(others, key=distance)
