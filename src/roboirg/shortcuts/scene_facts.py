"""What a viewer of the first picture and of the video can know of a scene, as features.

Nothing of the goal, and nothing that cannot be seen: no names, no order in which objects were
placed, and no movement that begins later than the policy's turn but for its kind.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping

from roboirg.core.conditions import Fact
from roboirg.core.episode import Scene, SceneObject
from roboirg.core.motions import Shuttle, Swap

SceneFacts = Mapping[str, float]
"""Numbers by name, and 1 for each fact that holds."""


def scene_facts(scene: Scene) -> SceneFacts:
    """Return the facts of a scene: counts, colors, places, and what the video shows."""
    return {**dict(_standing(scene)), **dict(_moving(scene)), **dict(_shown(scene))}


def _standing(scene: Scene) -> Iterator[tuple[str, float]]:
    """Yield how many things of each kind and color there are, where, and what is nearest.

    A scene with one red cube has ``red cube × 1``, ``x of red cube`` and so on. Only objects that
    look like no other have a place of their own.
    """
    counts = Counter(map(_look, scene.objects))
    for look, count in counts.items():
        yield f"{look} × {count}", 1.0
    unique = [item for item in scene.objects if counts[_look(item)] == 1]
    for item in unique:
        look = _look(item)
        yield f"x of {look}", item.position.x
        yield f"y of {look}", item.position.y
        nearest = _nearest(item, unique)
        if nearest is not None:
            yield f"nearest to {look}: {_look(nearest)}", 1.0


def _nearest(item: SceneObject, others: Iterable[SceneObject]) -> SceneObject | None:
    """Return the nearest other object that has a color; None if there is none."""
    colored = [other for other in others if other.color and other is not item]

    def distance(other: SceneObject) -> float:
        return math.dist(item.position[:2], other.position[:2])

    return min(colored, key=distance, default=None)


def _moving(scene: Scene) -> Iterator[tuple[str, float]]:
    """Yield what moves by itself: how many movements of a kind, of which colors, how fast."""
    kinds = Counter(type(motion).__name__ for motion in scene.motions)
    for kind, count in kinds.items():
        yield f"{kind} × {count}", 1.0
    for motion in scene.motions:
        if isinstance(motion, Shuttle):
            yield f"interval {motion.interval}", 1.0
        elif isinstance(motion, Swap):
            for name in (motion.first, motion.second):
                yield f"swapped: {_seen_as(scene, name)}", 1.0


def _shown(scene: Scene) -> Iterator[tuple[str, float]]:
    """Yield the acts of the video: at which rank each comes, that it comes, and how often.

    A video with two presses has ``act 0: …``, ``act 1: …``, ``shown: …``, ``shown: … × 2`` and
    ``acts × 2``.
    """
    acts = [_act(scene, fact) for fact in scene.past]
    for rank, act in enumerate(acts):
        yield f"act {rank}: {act}", 1.0
    for act, count in Counter(acts).items():
        yield f"shown: {act}", 1.0
        yield f"shown: {act} × {count}", 1.0
    yield f"acts × {len(acts)}", 1.0


def _act(scene: Scene, fact: Fact) -> str:
    """Return an act as it can be seen: ``placed red cube target``."""
    return f"{fact.kind} {_seen_as(scene, fact.subject)} {_seen_as(scene, fact.place)}"


def _seen_as(scene: Scene, name: str | None) -> str:
    """Return the look of the object of a name, with the color of the cube that it covers."""
    if name is None or all(item.name != name for item in scene.objects):
        return ""
    look = _look(scene[name])
    hidden = scene.hidden_in(name)
    return look if hidden is None else f"{look} over {hidden.color}"


def _look(item: SceneObject) -> str:
    """Return the kind of an object with its color, if it has one: ``red cube``."""
    return item.kind if item.color is None else f"{item.color} {item.kind}"
