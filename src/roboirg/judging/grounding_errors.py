"""Classify an act that the current stage does not expect."""

from __future__ import annotations

from collections.abc import Sequence

from roboirg.core.conditions import Fact, facts_of
from roboirg.core.episode import Stage
from roboirg.core.fact_traits import FactRole
from roboirg.core.failures import FailureName


def classify_grounding_error(
    fact: Fact, stages: Sequence[Stage], expected_stage: int
) -> FailureName:
    """Return the grounding failure of an act that another stage expects, or none.

    | the act | is |
    | --- | --- |
    | is expected later, and is the press that ends the task: some acts before it are missing | \
``wrong_count`` |
    | is expected later, otherwise or with nothing but a release before it | ``wrong_order`` |
    | is expected with another object | ``wrong_object`` |
    | was expected before: once too often | ``wrong_count`` |
    | is expected with the same object at another place | ``wrong_place`` |
    | is never expected | ``wrong_object`` |
    """
    expected = [facts_of(stage.expects) for stage in stages]
    now, past = expected[expected_stage], expected[:expected_stage]
    later = range(expected_stage + 1, len(stages))
    next_use = next((index for index in later if fact in expected[index]), None)
    if next_use is not None and not _repeats(fact, now, past):
        return _classify_early(fact, expected[expected_stage:next_use])
    if any(other.kind == fact.kind and other.subject != fact.subject for other in now):
        return "wrong_object"
    if any(fact in facts for facts in past):
        return "wrong_count"
    return "wrong_place" if _is_misplaced(fact, expected) else "wrong_object"


def _repeats(fact: Fact, now: tuple[Fact, ...], past: Sequence[tuple[Fact, ...]]) -> bool:
    """Return whether the last stage expected the act and this one expects it at another place."""
    again = bool(past) and fact in past[-1] and fact not in now
    return again and any(_is_alike(fact, one) for one in now)


def _classify_early(fact: Fact, skipped: Sequence[tuple[Fact, ...]]) -> FailureName:
    """Classify an act before its time by the expected acts that it skips."""
    only_releases = all(one.traits.role is FactRole.RELEASE for facts in skipped for one in facts)
    ends_task = fact.traits.role is FactRole.PRESS
    return "wrong_count" if ends_task and not only_releases else "wrong_order"


def _is_misplaced(fact: Fact, expected: Sequence[tuple[Fact, ...]]) -> bool:
    """Return whether any stage expects the same act with the same object at another place."""
    alike = (one for facts in expected for one in facts if _is_alike(fact, one))
    return any(one.place != fact.place for one in alike)


def _is_alike(fact: Fact, other: Fact) -> bool:
    return other.kind == fact.kind and other.subject == fact.subject
