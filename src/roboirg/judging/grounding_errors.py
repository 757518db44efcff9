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

    The first row that fits decides. `expected_stage` is the index of the current stage.
    """
    expected = [facts_of(stage.expects) for stage in stages]
    now = expected[expected_stage]
    past = expected[:expected_stage]
    later_stage = next_stage_with(fact, stages, expected_stage)
    # An act that was just done and is done again at once is one too many, though it is due later.
    if later_stage is not None and not _repeats(fact, now, past):
        return _classify_early(fact, expected[expected_stage:later_stage])
    if any(other.kind == fact.kind and other.subject != fact.subject for other in now):
        return "wrong_object"
    if any(fact in facts for facts in past):
        return "wrong_count"
    if any(_is_elsewhere(fact, facts) for facts in expected):
        return "wrong_place"
    return "wrong_object"


def next_stage_with(fact: Fact, stages: Sequence[Stage], current: int) -> int | None:
    """Return the index of the first stage after the current one that expects a fact, if any."""
    for index in range(current + 1, len(stages)):
        if fact in facts_of(stages[index].expects):
            return index
    return None


def _repeats(fact: Fact, now: tuple[Fact, ...], past: Sequence[tuple[Fact, ...]]) -> bool:
    """Return whether the last stage expected the act and this one expects it at another place.

    The cube goes over the right target again, where it is due over the left one now.
    """
    if not past or fact not in past[-1] or fact in now:
        return False
    return _is_elsewhere(fact, now)


def _classify_early(fact: Fact, skipped: Sequence[tuple[Fact, ...]]) -> FailureName:
    """Return the failure of an act before its time, by the expected acts that it skips.

    A press that skips any act other than letting go is ``wrong_count``; everything else is
    ``wrong_order``. `skipped` has the facts that each skipped stage expects.
    """
    if fact.traits.role is not FactRole.PRESS:
        return "wrong_order"
    # A press often ends the task, so what it skips is never done.
    for facts in skipped:
        for skipped_act in facts:
            if skipped_act.traits.role is not FactRole.RELEASE:
                return "wrong_count"
    return "wrong_order"


def _is_elsewhere(fact: Fact, expected: tuple[Fact, ...]) -> bool:
    """Return whether the same act with the same object is expected at another place."""
    return any(other != fact and other._replace(place=fact.place) == fact for other in expected)
