"""Events: facts that begin or cease to hold, each with its step."""

from __future__ import annotations

from collections.abc import Set as AbstractSet
from typing import NamedTuple

from roboirg.core.conditions import Fact


class Event(NamedTuple):
    """A fact began to hold (`holds`) or ceased to, at the evaluation after `step` steps."""

    step: int
    fact: Fact
    holds: bool

    def as_dict(self) -> dict[str, str | int | bool | None]:
        """The event as plain JSON values, for records."""
        kind, subject, place = self.fact
        return {
            "step": self.step,
            "kind": kind,
            "subject": subject,
            "place": place,
            "holds": self.holds,
        }


def changes(step: int, before: AbstractSet[Fact], now: AbstractSet[Fact]) -> tuple[Event, ...]:
    """What changed between two evaluations, in a fixed order."""
    begun = [Event(step, fact, True) for fact in sorted(now - before, key=_order)]
    ceased = [Event(step, fact, False) for fact in sorted(before - now, key=_order)]
    return (*ceased, *begun)


def _order(fact: Fact) -> tuple[str, str, str]:
    return fact.kind, fact.subject, fact.place or ""
