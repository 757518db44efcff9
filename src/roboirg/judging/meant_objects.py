"""Which objects a stage means: which ones the policy may handle to complete it.

A stage may expect any of several objects, as BinFill's stages expect any cube. Which of them are
still meant depends on all stages that expect the same, since these may be done in any order.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from collections.abc import Set as AbstractSet

from roboirg.core.conditions import Fact, facts_of
from roboirg.core.episode import Color, ObjectKind, Scene, Stage

_Look = tuple[ObjectKind, Color | None]
"""Kind and color of an object: those with the same look may stand for each other."""


def meant_objects(
    stages: Sequence[Stage], index: int, scene: Scene, facts: AbstractSet[Fact] = frozenset()
) -> frozenset[str]:
    """Return the names of the objects that the policy may handle to complete a stage.

    Most stages name one object. Others leave a choice: in BinFill, with *two red cubes, one blue
    one*, each of the three stages expects any red or blue cube in the bin, in any order. At first
    every red and blue cube is meant; when two red ones are in the bin, only the blue ones are.

    So the objects are counted by their look (kind and color). A look is still needed as often as
    such stages take it, less the objects of this look with a fact that lasts, such as *in the bin*.

    Args:
        stages: all that the policy is to complete, done ones as well.
        index: of the stage.
        scene: with all objects, also others that look like those that the scripted expert takes.
        facts: that hold now. Lasting ones must be about objects that the stage expects.
    """
    stage = stages[index]
    subjects = _subjects(stage)
    if len(subjects) <= 1:
        # What is handled need not be what something is expected of.
        return frozenset({*subjects, stage.primitive.subject})

    looks = {name: (scene[name].kind, scene[name].color) for name in subjects}
    still_needed: Counter[_Look] = Counter()
    for name in _taken_in_any_order(stages, stage):
        still_needed[looks[name]] += 1
    for fact in facts:
        if fact.traits.lasts:
            still_needed[looks[fact.subject]] -= 1
    return frozenset(name for name, look in looks.items() if still_needed[look] > 0)


def _taken_in_any_order(stages: Sequence[Stage], stage: Stage) -> Iterator[str]:
    """Yield what the oracle takes in each stage with the same movement and objects as a stage.

    The stage itself is among them; they may be done in any order. A name may come several times.
    """
    for other in stages:
        if other.primitive.kind == stage.primitive.kind and _subjects(other) == _subjects(stage):
            yield other.primitive.subject


def _subjects(stage: Stage) -> set[str]:
    """Return the names of the objects in what a stage expects."""
    return {fact.subject for fact in facts_of(stage.expects)}
