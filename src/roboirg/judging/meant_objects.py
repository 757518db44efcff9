"""Which objects a stage means: equal ones may stand for each other, and free orders are free."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from collections.abc import Set as AbstractSet

from roboirg.core.conditions import Fact, facts_of
from roboirg.core.episode import Scene, Stage


def meant_objects(
    stages: Sequence[Stage], index: int, scene: Scene, facts: AbstractSet[Fact] = frozenset()
) -> frozenset[str]:
    """Return the names of the objects with which a stage can rightly be completed.

    Args:
        stages: of the policy.
        index: of the stage. Stages with the same objects and the same movement may be done in any
            order, and with any objects that look like those that the oracle takes.
        scene: of the episode.
        facts: that hold, by which what is done for good is not meant again.
    """
    stage = stages[index]
    subjects = _subjects(stage)
    if len(subjects) <= 1:
        return frozenset({*subjects, stage.primitive.subject})
    looks = {name: (scene[name].kind, scene[name].color) for name in subjects}
    alike = [
        one
        for one in stages
        if one.primitive.kind == stage.primitive.kind and _subjects(one) == subjects
    ]
    needed = Counter(looks[one.primitive.subject] for one in alike)
    needed -= Counter(looks[one.subject] for one in facts if one.traits.lasts)
    return frozenset(name for name, look in looks.items() if look in needed)


def _subjects(stage: Stage) -> set[str]:
    return {fact.subject for fact in facts_of(stage.expects)}
