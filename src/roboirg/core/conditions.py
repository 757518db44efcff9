"""Facts of the world and conditions on them: what stages expect and forbid, as plain data.

`roboirg.judging` evaluates conditions once after each control step, from the facts that hold then
and from what has happened before.
"""

from __future__ import annotations

from typing import NamedTuple

from roboirg.core.fact_traits import FactKind, FactTraits, fact_traits
from roboirg.core.failures import FailureName


class Fact(NamedTuple):
    """Something that is true in the world at one evaluation, one after each control step.

    Attributes:
        kind: what is true; `roboirg.core.fact_traits` defines each kind.
        subject: name of the object it is about, or ``"robot"``.
        place: name of the second object, if the kind has one.
    """

    kind: FactKind
    subject: str
    place: str | None = None

    @property
    def traits(self) -> FactTraits:
        """What its kind means."""
        return fact_traits(self.kind)


class FactCount(NamedTuple):
    """A condition on how many of the facts hold now: at least `least`, at most `most` if given."""

    facts: tuple[Fact, ...]
    least: int = 1
    most: int | None = None


class OccurrenceCount(NamedTuple):
    """A condition on how many times the facts, taken together, have started to hold.

    Attributes:
        facts: which ones are counted.
        least: the smallest count that meets the condition.
        until: only starts at or before this control step since reset count; None for all.
    """

    facts: tuple[Fact, ...]
    least: int = 1
    until: int | None = None


class Elapsed(NamedTuple):
    """A condition on the control steps that have passed since reset or since a timer started.

    Attributes:
        least: the fewest.
        most: the most; None for no bound.
        timer: name of the timer, started by the first evaluation of the first stage that has it;
            None counts from reset.
    """

    least: int
    most: int | None = None
    timer: str | None = None


class All(NamedTuple):
    """A condition that is met when each of its parts is."""

    of: tuple[Fact | FactCount | OccurrenceCount | Elapsed, ...]


Condition = Fact | FactCount | OccurrenceCount | Elapsed | All


class Rule(NamedTuple):
    """A condition that fails the episode, and how to describe the failure.

    Attributes:
        condition: must not hold.
        cause: what was done, verb and object in the past tense, for records: ``"pressed the button
            too early"``.
        failure: name of the failure; None to conclude it from the facts, as for a fact that a
            stage forbids. It does not affect the verdict.
    """

    condition: Condition
    cause: str
    failure: FailureName | None = None


def absent(fact: Fact) -> FactCount:
    """Return the condition that a fact does not hold: that at most 0 of one fact hold."""
    return FactCount((fact,), least=0, most=0)


def facts_of(condition: Condition | Rule) -> tuple[Fact, ...]:
    """Return all facts that a condition, or the condition of a rule, mentions.

    One that only counts control steps (`Elapsed`) mentions none.
    """
    match condition:
        case Fact():
            return (condition,)
        case Rule():
            return facts_of(condition.condition)
        case FactCount() | OccurrenceCount():
            return condition.facts
        case All():
            facts: list[Fact] = []
            for part in condition.of:
                facts += facts_of(part)
            return tuple(facts)
        case Elapsed():
            return ()
