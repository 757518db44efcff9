"""What has happened so far, as far as conditions ask for it."""

from __future__ import annotations

import bisect
from collections.abc import Set as AbstractSet

from roboirg.core.conditions import All, Condition, Elapsed, Fact, FactCount, OccurrenceCount


class FactHistory:
    """Follows the facts from evaluation to evaluation and answers conditions.

    Attributes:
        step: control steps since reset at the last evaluation.
        facts: all that held then.
    """

    def __init__(self) -> None:
        self.step = 0
        self.facts: AbstractSet[Fact] = frozenset()
        self._begun: dict[Fact, list[int]] = {}
        self._timers: dict[str, int] = {}

    def follow(self, step: int, facts: AbstractSet[Fact]) -> None:
        """Take note of an evaluation."""
        if facts is not self.facts:
            for fact in facts - self.facts:
                self._begun.setdefault(fact, []).append(step)
        self.step, self.facts = step, facts

    def start_timer(self, name: str) -> None:
        """Start a timer at this evaluation, unless it runs already."""
        self._timers.setdefault(name, self.step)

    def holds(self, condition: Condition) -> bool:
        """Whether a condition is met at the last evaluation."""
        match condition:
            case Fact():
                return condition in self.facts
            case FactCount(facts, least, most):
                return _within(sum(fact in self.facts for fact in facts), least, most)
            case OccurrenceCount(facts, least, until):
                return sum(self._beginnings(fact, until) for fact in facts) >= least
            case Elapsed(least, most, timer):
                start = 0 if timer is None else self._timers.get(timer)
                return start is not None and _within(self.step - start, least, most)
            case All(of):
                return all(self.holds(part) for part in of)

    def _beginnings(self, fact: Fact, until: int | None) -> int:
        """How often a fact has begun, at or before a step."""
        steps = self._begun.get(fact, [])
        return len(steps) if until is None else bisect.bisect_right(steps, until)


def _within(number: int, least: int, most: int | None) -> bool:
    return number >= least and (most is None or number <= most)
