"""Refuse stages that cannot be completed: facts that can never hold in their scene."""

from __future__ import annotations

from collections.abc import Iterable

from roboirg.core.conditions import Fact, facts_of
from roboirg.core.episode import Scene, Stage
from roboirg.core.errors import InvalidValueError, UnknownNameError
from roboirg.core.fact_traits import FACT_TRAITS, FactTraits

ROBOT = "robot"
"""The subject of facts about the robot itself."""


def check_stages(task: str, scene: Scene, stages: Iterable[Stage]) -> None:
    """Check that each fact that stages expect or forbid is one that can hold in a scene."""
    kinds = {item.name: item.kind for item in scene.objects} | {ROBOT: ROBOT}
    for stage in stages:
        for condition in (stage.expects, *stage.forbids):
            for fact in facts_of(condition):
                if fact.kind not in FACT_TRAITS:
                    raise UnknownNameError("kind of fact", fact.kind, FACT_TRAITS)
                for problem in _problems(fact, FACT_TRAITS[fact.kind], kinds):
                    raise InvalidValueError(f"{task}: {fact!r} can never hold: {problem}.")


def _problems(fact: Fact, traits: FactTraits, kinds: dict[str, str]) -> Iterable[str]:
    """Yield why a fact can never hold, given the kind of each object."""
    if fact.place is None and traits.places:
        yield f"it needs a place, which is a {' or a '.join(traits.places)}"
    if fact.place is not None and not traits.places:
        yield f"{fact.kind} has no place"
    parts = ((fact.subject, traits.subjects), (fact.place, traits.places))
    for name, fitting in parts:
        if name is None:
            continue
        if name not in kinds:
            yield f"the scene has no {name!r}; it has {', '.join(kinds)}"
        elif kinds[name] not in fitting:
            yield f"{name!r} is a {kinds[name]}, not a {' or a '.join(fitting)}"
