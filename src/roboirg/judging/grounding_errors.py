"""Which grounding failure an act is that was not due."""

from __future__ import annotations

from collections.abc import Sequence

from roboirg.core.conditions import Fact, FactKind, GroundingFailure, facts_of
from roboirg.core.episode import Stage

RELEASES: frozenset[FactKind] = frozenset({"lying", "put_down"})
"""Facts of something that has merely been let go."""
CLOSING: FactKind = "pressed"
"""The act that says that all has been done."""


def classify_grounding_error(fact: Fact, stages: Sequence[Stage], due: int) -> GroundingFailure:
    """What it means that something was done while something else was due.

    | the act | is |
    | --- | --- |
    | is due later, and is the press that ends the task: too few of the others were done | \
``wrong_count`` |
    | is due later, otherwise or with nothing left but to let go | ``wrong_order`` |
    | is due with another object | ``wrong_object`` |
    | was due before: once too often | ``wrong_count`` |
    | is due with the same object at another place | ``wrong_place`` |
    | is never due | ``wrong_object`` |

    Args:
        fact: that came to hold.
        stages: of the policy.
        due: index of the stage that was due.
    """
    expected = [facts_of(stage.expects) for stage in stages]
    now = expected[due]
    again = due > 0 and fact in expected[due - 1] and fact not in now
    later = [index for index in range(due + 1, len(stages)) if fact in expected[index]]
    if later and not (again and _same_subject(fact, now)):
        skipped = {other.kind for facts in expected[due : later[0]] for other in facts}
        early = fact.kind == CLOSING and not skipped <= RELEASES
        return "wrong_count" if early else "wrong_order"
    if any(other.kind == fact.kind and other.subject != fact.subject for other in now):
        return "wrong_object"
    if any(fact in facts for facts in expected[:due]):
        return "wrong_count"
    elsewhere = (other for facts in expected for other in facts if other.kind == fact.kind)
    if any(other.subject == fact.subject and other.place != fact.place for other in elsewhere):
        return "wrong_place"
    return "wrong_object"


def _same_subject(fact: Fact, now: tuple[Fact, ...]) -> bool:
    return any(other.kind == fact.kind and other.subject == fact.subject for other in now)
