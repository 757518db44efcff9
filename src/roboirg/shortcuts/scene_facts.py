"""What a viewer of the first picture and of the video can know of a scene, as features.

Nothing of the goal, and nothing that cannot be seen: no names, no order in which objects were
placed, and no movement that begins later than the policy's turn but for its kind.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterator, Mapping

from roboirg.core.conditions import Fact
from roboirg.core.episode import Scene, SceneObject
from roboirg.core.motions import Shuttle, Swap

SceneFacts = Mapping[str, float]
"""Numbers by name, and 1 for each fact that holds."""


def scene_facts(scene: Scene) -> SceneFacts:
    """Return the facts of a scene: counts, colors, places, and what the video shows."""
    return {**dict(_standing(scene)), **dict(_moving(scene)), **dict(_shown(scene))}


def _standing(scene: Scene) -> Iterator[tuple[str, float]]:
    """Yield how many things of each kind and color there are, where, and what is nearest."""
    things = Counter(_look(one) for one in scene.objects)
    for look, count in things.items():
        yield f"{look} × {count}", 1.0
    alone = {look: one for one in scene.objects if things[look := _look(one)] == 1}
    for look, one in alone.items():
        yield f"x of {look}", one.position.x
        yield f"y of {look}", one.position.y
        if others := [other for other in alone if other != look and alone[other].color]:
            spots = {other: alone[other].position[:2] for other in others}
            nearest = min(spots, key=lambda other: math.dist(one.position[:2], spots[other]))
            yield f"nearest to {look}: {nearest}", 1.0


def _moving(scene: Scene) -> Iterator[tuple[str, float]]:
    """Yield what moves by itself: how many movements of a kind, of which colors, how fast."""
    for kind, count in Counter(type(one).__name__ for one in scene.motions).items():
        yield f"{kind} × {count}", 1.0
    for motion in scene.motions:
        if isinstance(motion, Shuttle):
            yield f"interval {motion.interval}", 1.0
        elif isinstance(motion, Swap):
            for name in (motion.first, motion.second):
                yield f"swapped: {_seen_as(scene, name)}", 1.0


def _shown(scene: Scene) -> Iterator[tuple[str, float]]:
    """Yield the acts of the video, alone, with their rank, and how many there are of each."""
    for rank, fact in enumerate(scene.past):
        yield f"act {rank}: {_act(scene, fact)}", 1.0
    for act, count in Counter(_act(scene, fact) for fact in scene.past).items():
        yield f"shown: {act}", 1.0
        yield f"shown: {act} × {count}", 1.0
    yield f"acts × {len(scene.past)}", 1.0


def _act(scene: Scene, fact: Fact) -> str:
    return " ".join((fact.kind, *(_seen_as(scene, one) for one in (fact.subject, fact.place))))


def _seen_as(scene: Scene, name: str | None) -> str:
    """Return the look of the object of a name, with the color of the cube that it covers."""
    if name is None or all(one.name != name for one in scene.objects):
        return ""
    hidden = scene.hidden_in(name)
    return _look(scene[name]) if hidden is None else f"{_look(scene[name])} over {hidden.color}"


def _look(one: SceneObject) -> str:
    return one.kind if one.color is None else f"{one.color} {one.kind}"
