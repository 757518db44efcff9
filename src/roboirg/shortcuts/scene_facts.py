"""Features of a scene, for models that see the scene but not the words.

They hold what a viewer of the first picture and of the video can know: nothing of the goal, no
names, no order in which objects were placed, and of later movements only the kind.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping

from roboirg.core.conditions import Fact
from roboirg.core.episode import Scene, SceneObject
from roboirg.core.motions import Shuttle, Swap

SceneFacts = Mapping[str, float]
"""Features by name: a number, or 1 for a fact that holds. Facts that do not hold are left out."""


def scene_facts(scene: Scene) -> SceneFacts:
    """Return what can be seen in a scene and its video, as features for a model.

    For example ``{"red cube × 1": 1.0, "x of red cube": 0.12, "acts × 2": 1.0}``: there is one red
    cube, its x is 0.12 (meters, world frame), and the video shows two acts of the robot.
    """
    return {
        **dict(_object_features(scene)),
        **dict(_motion_features(scene)),
        **dict(_video_features(scene)),
    }


def _object_features(scene: Scene) -> Iterator[tuple[str, float]]:
    """Yield features of the objects: how many look alike, where they are, what is near.

    A scene with one red cube has ``("red cube × 1", 1.0)``, ``("x of red cube", 0.12)`` (meters)
    and so on. Objects that look like others have no position: a viewer cannot name them.
    """
    counts = Counter(map(_appearance, scene.objects))
    for appearance, count in counts.items():
        yield f"{appearance} × {count}", 1.0
    unique = [item for item in scene.objects if counts[_appearance(item)] == 1]
    for item in unique:
        appearance = _appearance(item)
        yield f"x of {appearance}", item.position.x
        yield f"y of {appearance}", item.position.y
        nearest = _nearest(item, unique)
        if nearest is not None:
            yield f"nearest to {appearance}: {_appearance(nearest)}", 1.0


def _nearest(item: SceneObject, others: Iterable[SceneObject]) -> SceneObject | None:
    """Return the nearest other object that has a color, by distance on the table; None if none."""
    colored = [other for other in others if other.color and other is not item]

    def distance(other: SceneObject) -> float:
        return math.dist(item.position[:2], other.position[:2])

    return min(colored, key=distance, default=None)


def _motion_features(scene: Scene) -> Iterator[tuple[str, float]]:
    """Yield features of what moves by itself.

    Two swaps give ``("Swap × 2", 1.0)`` and ``("swapped: container over red", 1.0)`` for each
    object that takes part; a cube that moves back and forth gives ``("interval 30", 1.0)``, the
    control steps from one end to the other.
    """
    kinds = Counter(type(motion).__name__ for motion in scene.motions)
    for kind, count in kinds.items():
        yield f"{kind} × {count}", 1.0
    for motion in scene.motions:
        if isinstance(motion, Shuttle):
            yield f"interval {motion.interval}", 1.0
        elif isinstance(motion, Swap):
            for name in (motion.first, motion.second):
                yield f"swapped: {_appearance_of(scene, name)}", 1.0


def _video_features(scene: Scene) -> Iterator[tuple[str, float]]:
    """Yield features of the video's acts: the rank of each, that it occurs, and how often.

    A video that shows a button pressed twice has ``act 0: pressed button``, ``act 1: pressed
    button``, ``shown: pressed button``, ``shown: pressed button × 2`` and ``acts × 2``, each 1.0.
    """
    acts = [_act_name(scene, fact) for fact in scene.past]
    for rank, act in enumerate(acts):
        yield f"act {rank}: {act}", 1.0
    for act, count in Counter(acts).items():
        yield f"shown: {act}", 1.0
        yield f"shown: {act} × {count}", 1.0
    yield f"acts × {len(acts)}", 1.0


def _act_name(scene: Scene, fact: Fact) -> str:
    """Return an act of the robot as it can be seen: ``placed red cube target``."""
    return f"{fact.kind} {_appearance_of(scene, fact.subject)} {_appearance_of(scene, fact.place)}"


def _appearance_of(scene: Scene, name: str | None) -> str:
    """Return how the object with a name looks, with the color of a cube that it covers.

    ``"cube_1"`` -> ``red cube``, ``"container_1"`` -> ``container over red``. Empty if the scene
    has no object with that name, or if the name is None.
    """
    if name is None or all(item.name != name for item in scene.objects):
        return ""
    appearance = _appearance(scene[name])
    hidden = scene.hidden_in(name)
    return appearance if hidden is None else f"{appearance} over {hidden.color}"


def _appearance(item: SceneObject) -> str:
    """Return the kind of an object with its color, if it has one: ``red cube``."""
    return item.kind if item.color is None else f"{item.color} {item.kind}"
