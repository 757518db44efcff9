"""Events: facts that start or cease to hold, each with its step."""

from __future__ import annotations

from collections.abc import Set as AbstractSet
from typing import NamedTuple

from roboirg.core.conditions import Fact


class Event(NamedTuple):
    """A fact that started to hold (`holds`) or ceased to, at the evaluation after `step` steps."""

    step: int
    fact: Fact
    holds: bool

    def as_dict(self) -> dict[str, str | int | bool | None]:
        """Return the event as plain JSON values, for records."""
        kind, subject, place = self.fact
        return {
            "step": self.step,
            "kind": kind,
            "subject": subject,
            "place": place,
            "holds": self.holds,
        }


def changes(step: int, before: AbstractSet[Fact], now: AbstractSet[Fact]) -> tuple[Event, ...]:
    """Return the events between two evaluations: first the facts that ceased, then the new ones."""
    started = [Event(step, fact, True) for fact in sorted(now - before, key=_order)]
    ceased = [Event(step, fact, False) for fact in sorted(before - now, key=_order)]
    return (*ceased, *started)


def _order(fact: Fact) -> tuple[str, str, str]:
    return fact.kind, fact.subject, fact.place or ""
