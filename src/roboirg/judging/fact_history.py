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
        self.step = step
        self.facts = facts

    def start_timer(self, name: str) -> None:
        """Start a timer at this evaluation, unless it is running."""
        self._timers.setdefault(name, self.step)

    def holds(self, condition: Condition) -> bool:
        """Return whether a condition is met at the last step that was recorded.

        A condition is a fact; a number of facts that hold; how often facts began to hold, up to a
        step if one is given; a time since a timer or the reset; or several of these together.
        """
        match condition:
            case Fact():
                return condition in self.facts
            case FactCount(facts, least, most):
                return _is_within(self._count_holding(facts), least, most)
            case OccurrenceCount(facts, least, until):
                return self._count_occurrences(facts, until) >= least
            case Elapsed(least, most, timer):
                start = self._timer_start(timer)
                return start is not None and _is_within(self.step - start, least, most)
            case All(parts):
                return all(self.holds(part) for part in parts)

    def next_change(self, condition: Elapsed) -> float:
        """Return the next step at which a time begins or ceases to be met; or infinity.

        50 to 60 steps after reset: at step 10 -> 50, at step 55 -> 61, at step 70 -> infinity. A
        timer that has not started gives infinity.
        """
        start = self._timer_start(condition.timer)
        if start is None:
            return math.inf
        first_step = start + condition.least
        if first_step > self.step:
            return first_step
        if condition.most is None:
            return math.inf
        first_step_after = start + condition.most + 1
        return first_step_after if first_step_after > self.step else math.inf

    def _count_holding(self, facts: tuple[Fact, ...]) -> int:
        """Return how many of some facts hold at the last evaluation."""
        return sum(fact in self.facts for fact in facts)

    def _count_occurrences(self, facts: tuple[Fact, ...], until: int | None) -> int:
        """Return how many times some facts have started to hold, up to a step if one is given."""
        count = 0
        for fact in facts:
            steps = self._start_steps.get(fact, [])
            count += len(steps) if until is None else bisect.bisect_right(steps, until)
        return count

    def _timer_start(self, timer: str | None) -> int | None:
        """Return the step at which a timer started, or None; without a name, that of reset."""
        return 0 if timer is None else self._timers.get(timer)


def _is_within(number: int, least: int, most: int | None) -> bool:
    return number >= least and (most is None or number <= most)
