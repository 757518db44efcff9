"""Facts of the world and conditions on them: what stages expect and forbid, as plain data.

A condition is evaluated once after each control step, from the facts that hold then and from
what has happened before; `roboirg.judging` does it.
"""

from __future__ import annotations

from typing import Literal, NamedTuple

FactKind = Literal[
    "picked",
    "lying",
    "placed",
    "over",
    "binned",
    "lifted",
    "put_down",
    "reached",
    "held",
    "pressed",
    "hovering",
    "near",
    "stopped",
    "still",
    "home",
]


GroundingFailure = Literal[
    "wrong_object", "wrong_count", "wrong_order", "wrong_time", "wrong_place"
]
"""Something else was done than what was meant."""

ExecutionFailure = Literal[
    "nothing_reached", "missed_grasp", "dropped", "misplaced", "out_of_time", "unreachable"
]
"""What was meant was not brought off."""

LASTING_KINDS: frozenset[FactKind] = frozenset({"binned"})
"""Facts of these kinds never cease to hold."""


class Fact(NamedTuple):
    """Something that is true in the world at one evaluation, one after each control step.

    | kind | subject, place | true while |
    | --- | --- | --- |
    | ``picked`` | cube or tape | it is above z 0.05 and grasped |
    | ``lying`` | cube or tape | it lies released, z <= 0.035 |
    | ``placed`` | cube or tape, target or site | it lies released within 0.05 (xy) of the place |
    | ``over`` | cube, target | it came within 0.03 (xy) below z 0.12, until beyond 0.04 or z 0.3 |
    | ``binned`` | cube or tape, bin or box | from the moment on at which it has fallen in: \
released within 0.05 (xy), z <= 0.035, fingers more than 0.02 open, the hand more than 0.02 away |
    | ``lifted`` | container | its origin is above z 0.15 |
    | ``put_down`` | container | its origin is at z <= 0.07, released, the hand above z 0.05 |
    | ``reached`` | cube, tape or container | the tool center is within 0.03 of its origin |
    | ``held`` | cube, tape or container | both fingers grasp it, at whatever height |
    | ``pressed`` | button | its cap is more than 0.005 down |
    | ``hovering`` | robot, button | the hand is within 0.03 (xy) of the button and below z 0.2 |
    | ``near`` | shuttle, target | its center is within 0.06 (xy) of the target's |
    | ``stopped`` | shuttle, target | it has been stopped for good, and is near |
    | ``still`` | ``"robot"`` | no arm joint moves faster than 0.2 rad/s |
    | ``home`` | ``"robot"`` | all nine joints are within 0.01 of the home position |

    Thresholds, meters: RoboMME, evaluation mode. ``reached`` and ``held`` are our own: no stage
    asks for them, they tell how something failed.
    """

    kind: FactKind
    subject: str
    place: str | None = None


class FactCount(NamedTuple):
    """So many of the facts hold now: at least `least`, and at most `most` if that is given."""

    facts: tuple[Fact, ...]
    least: int = 1
    most: int | None = None


class OccurrenceCount(NamedTuple):
    """The facts, taken together, have begun to hold at least so often.

    Attributes:
        facts: which ones are counted.
        least: how often.
        until: only beginnings at or before this control step since reset count; None for all.
    """

    facts: tuple[Fact, ...]
    least: int = 1
    until: int | None = None


class Elapsed(NamedTuple):
    """So many control steps have passed, since reset or since a stage's timer started.

    Attributes:
        least: no fewer.
        most: and no more; None for no bound.
        timer: name of the timer, started by the first evaluation of the first stage that has it;
            None counts from reset.
    """

    least: int
    most: int | None = None
    timer: str | None = None


class All(NamedTuple):
    """Every one of several conditions."""

    of: tuple[Fact | FactCount | OccurrenceCount | Elapsed, ...]


Condition = Fact | FactCount | OccurrenceCount | Elapsed | All


class Rule(NamedTuple):
    """A condition that fails the episode, and how to tell what was wrong.

    Attributes:
        condition: must not hold.
        cause: what happened, in words, for records: ``"pressed the button too early"``.
        failure: what it means that this rule is broken; None if the facts in it tell, as they do
            where a stage forbids a fact. It judges nothing.
    """

    condition: Condition
    cause: str
    failure: GroundingFailure | ExecutionFailure | None = None


def absent(fact: Fact) -> FactCount:
    """The condition that a fact does not hold."""
    return FactCount((fact,), least=0, most=0)


def facts_of(condition: Condition | Rule) -> tuple[Fact, ...]:
    """All facts that a condition speaks of."""
    match condition:
        case Fact():
            return (condition,)
        case Rule():
            return facts_of(condition.condition)
        case FactCount() | OccurrenceCount():
            return condition.facts
        case All():
            return tuple(fact for part in condition.of for fact in facts_of(part))
        case Elapsed():
            return ()
