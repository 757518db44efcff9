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

    Args:
        objects: all possible partners; those that do not move are pinned meanwhile.
        initiators: names of the objects that start a swap, in order.
        start: step of the first swap; the others follow without a pause.
        lane: sideways swing, m.
        stage: index of the demonstration's stage from which `start` counts; None: from reset.
        partners: names of those with whom the first initiators change places instead, where known.
    """
    places: dict[str, Point] = {item.name: item.position for item in objects}
    swaps: list[Swap] = []
    chosen = itertools.zip_longest(initiators, partners[: len(initiators)])
    for number, (first, partner) in enumerate(chosen):
        second = partner or nearest(places, first)
        pinned = tuple(name for name in places if name not in (first, second))
        begin = start + number * SWAP_STEPS
        swaps.append(Swap(first, second, begin, SWAP_STEPS, lane, pinned, stage))
        places[first], places[second] = places[second], places[first]
    return tuple(swaps)


def places_at_last(scene: Scene) -> dict[str, Point]:
    """Return where each object of a scene stands after the last swap."""
    places = {item.name: item.position for item in scene.objects}
    for swap in scene.motions_of(Swap):
        first, second = swap.first, swap.second
        places[first], places[second] = places[second], places[first]
    return places


def last_step(motions: Iterable[Motion]) -> int:
    """Return the step at which the last swap is complete; 0 if there is none."""
    return max((one.start + one.steps for one in motions if isinstance(one, Swap)), default=0)


def nearest(places: dict[str, Point], name: str) -> str:
    """Return the object nearest to a named one in the plane."""
    here = places[name]

    def distance(other: str) -> float:
        return math.hypot(places[other].x - here.x, places[other].y - here.y)

    return min((other for other in places if other != name), key=distance)
