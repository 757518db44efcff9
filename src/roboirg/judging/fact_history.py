"""The history of facts that conditions need."""

from __future__ import annotations

import bisect
import math
from collections.abc import Set as AbstractSet

from roboirg.core.conditions import All, Condition, Elapsed, Fact, FactCount, OccurrenceCount


class FactHistory:
    """Records the facts of each evaluation and tests conditions.

    Attributes:
        step: control steps since reset at the last evaluation.
        facts: all that held then.
    """

    def __init__(self) -> None:
        self.step = 0
        self.facts: AbstractSet[Fact] = frozenset()
        self._start_steps: dict[Fact, list[int]] = {}
        self._timers: dict[str, int] = {}

    def update(self, step: int, facts: AbstractSet[Fact]) -> None:
        """Record the facts of an evaluation."""
        if facts is not self.facts:
            for fact in facts - self.facts:
                self._start_steps.setdefault(fact, []).append(step)
        self.step, self.facts = step, facts

    def start_timer(self, name: str) -> None:
        """Start a timer at this evaluation, unless it is running."""
        self._timers.setdefault(name, self.step)

    def holds(self, condition: Condition) -> bool:
        """Return whether a condition is met at the last evaluation."""
        match condition:
            case Fact():
                return condition in self.facts
            case FactCount(facts, least, most):
                return _within(sum(fact in self.facts for fact in facts), least, most)
            case OccurrenceCount(facts, least, until):
                return sum(self._occurrences(fact, until) for fact in facts) >= least
            case Elapsed(least, most, timer):
                start = 0 if timer is None else self._timers.get(timer)
                return start is not None and _within(self.step - start, least, most)
            case All(of):
                return all(self.holds(part) for part in of)

    def next_change(self, condition: Elapsed) -> float:
        """Return the next step at which the condition begins or ceases to be met; or infinity."""
        start = 0 if condition.timer is None else self._timers.get(condition.timer)
        if start is None:
            return math.inf
        steps = [start + condition.least]
        if condition.most is not None:
            steps.append(start + condition.most + 1)
        return min((step for step in steps if step > self.step), default=math.inf)

    def _occurrences(self, fact: Fact, until: int | None) -> int:
        """Return how many times a fact has started to hold, at or before a step if one is given."""
        steps = self._start_steps.get(fact, [])
        return len(steps) if until is None else bisect.bisect_right(steps, until)


def _within(number: int, least: int, most: int | None) -> bool:
    return number >= least and (most is None or number <= most)
