"""Replay a whole episode from its events by running the judge again."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from collections.abc import Set as AbstractSet
from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple

from roboirg.core.conditions import All, Condition, Fact, facts_of
from roboirg.core.episode import Episode, Stage
from roboirg.core.fact_traits import FactKind, FactRole
from roboirg.judging.fact_history import FactHistory
from roboirg.judging.judge import Judge, Status


class FactInterval(NamedTuple):
    """The steps in which a fact holds without a break.

    Attributes:
        fact: the fact.
        start: the first step at which it holds.
        end: the first step at which it no longer does; None if it holds to the last.
    """

    fact: Fact
    start: int
    end: int | None


class Decision(NamedTuple):
    """How an episode ended for a goal.

    Attributes:
        judge: after the verdict, or the last step.
        step: of the verdict, or the last one; since the world began.
    """

    judge: Judge
    step: int


@dataclass(frozen=True)
class EpisodeReplay:
    """One episode, step by step. Steps count since the world began.

    Attributes:
        episode: the episode.
        policy_start_step: steps of the world before the policy's turn.
        expected_stages: for each step, the index of the stage that its evaluation tests, counted
            from the policy's first stage (negative in the demonstration).
        facts: for each step, all facts that hold.
        intervals: of all facts, in the order of their starts.
        judge: after the last evaluation.
        attempts: intervals of facts of attempts, in the same order.
    """

    episode: Episode
    policy_start_step: int
    expected_stages: tuple[int, ...]
    facts: tuple[frozenset[Fact], ...]
    intervals: tuple[FactInterval, ...]
    judge: Judge
    attempts: tuple[FactInterval, ...] = ()

    @property
    def last_step(self) -> int:
        return len(self.facts) - 1

    @property
    def stages(self) -> tuple[Stage, ...]:
        """The policy's stages."""
        return self.episode.stages

    @property
    def expected_stage(self) -> int:
        """Index of the stage that is expected at the end, or at the verdict."""
        return self.judge.index - len(self.episode.demonstration)

    @property
    def acted_since(self) -> int:
        """The step at which an act last completed a stage, or else the policy's turn began.

        That time passes is no act.
        """
        acts = (step for done, step in self.completions() if facts_of(self.stages[done].expects))
        return max(acts, default=self.policy_start_step)

    def completions(self) -> Iterator[tuple[int, int]]:
        """Yield the index of each completed stage of the policy, and the step that completed it."""
        pairs = pairwise((*self.expected_stages, self.expected_stage))
        return ((now, step) for step, (now, then) in enumerate(pairs) if then != now >= 0)

    def started(self, *roles: FactRole, after: int | None = None) -> Iterator[FactInterval]:
        """Yield the intervals of facts with some roles that start later than a step.

        By default, those that start in the policy's turn.
        """
        start = self.policy_start_step if after is None else after
        return (
            one for one in self.intervals if one.start > start and one.fact.traits.role in roles
        )

    def tried(self, kind: FactKind, *subjects: str) -> Iterator[FactInterval]:
        """Yield the attempts of a kind in the policy's turn, with some subjects or with any."""
        start = self.policy_start_step
        own = (one for one in self.attempts if one.fact.kind == kind and one.start > start)
        return (one for one in own if not subjects or one.fact.subject in subjects)

    def stage_at(self, step: int) -> Stage:
        """Return the policy's stage that was tested at a step, or its first before its turn."""
        return self.stages[min(max(self.expected_stages[step], 0), len(self.stages) - 1)]

    def unmet(self) -> tuple[Fact, ...]:
        """Return the facts in all parts of the expected condition that are not met at the end."""
        history = FactHistory()
        for step, facts in enumerate(self.facts):
            history.update(step, facts)
        expects = self.stages[self.expected_stage].expects
        parts: tuple[Condition, ...] = expects.of if isinstance(expects, All) else (expects,)
        return tuple(f for part in parts if not history.holds(part) for f in facts_of(part))


def rejudge(
    episode: Episode,
    events: Sequence[Event],
    policy_start_step: int,
    elapsed_steps: int,
    attempts: Sequence[Event] = (),
) -> EpisodeReplay:
    """Judge an episode again by all its events, in order; steps count since the world began."""
    facts = facts_by_step(events, elapsed_steps)
    judge = Judge.of(episode)
    expected_stages: list[int] = []
    expected = -len(episode.demonstration)
    for step in _evaluations(judge, events, elapsed_steps):
        expected_stages += [expected] * (step + 1 - len(expected_stages))
        expected = judge.index - len(episode.demonstration)
    expected_stages += [expected] * (len(facts) - len(expected_stages))
    parts = _intervals(events), judge, _intervals(attempts)
    return EpisodeReplay(episode, policy_start_step, tuple(expected_stages), facts, *parts)


def decide(episode: Episode, events: Sequence[Event], elapsed_steps: int) -> Decision:
    """Judge an episode again up to its verdict; faster than `rejudge`."""
    judge = Judge.of(episode)
    for step in _evaluations(judge, events, elapsed_steps):
        if judge.status is not Status.ONGOING:
            return Decision(judge, step)
    return Decision(judge, elapsed_steps)


def completed_stages(
    episode: Episode, events: Sequence[Event], elapsed_steps: int
) -> dict[int, int]:
    """Return the steps that completed stages of the policy, by index; faster than `rejudge`."""
    judge = Judge.of(episode)
    found: dict[int, int] = {}
    for step in _evaluations(judge, events, elapsed_steps):
        found.setdefault(judge.index - len(episode.demonstration) - 1, step)
    return {stage: step for stage, step in found.items() if stage >= 0}


def _evaluations(judge: Judge, events: Sequence[Event], elapsed_steps: int) -> Iterator[int]:
    """Evaluate at each step at which anything may change, and yield the step."""
    spans = _changing_facts(events, elapsed_steps)
    ends = [*(start for start, _ in spans[1:]), elapsed_steps + 1]
    for (step, facts), end in zip(spans, ends, strict=True):
        moment = float(step)
        while moment < end:
            judge.update(int(moment), facts)
            yield int(moment)
            moment = judge.next_change()


def facts_by_step(events: Sequence[Event], elapsed_steps: int) -> tuple[frozenset[Fact], ...]:
    """Return all facts that hold after 0, 1, ... `elapsed_steps` steps.

    Steps without an event share one set.
    """
    all_facts: list[frozenset[Fact]] = []
    before: frozenset[Fact] = frozenset()
    for step, facts in _changing_facts(events, elapsed_steps):
        all_facts += [before] * (step - len(all_facts))
        before = facts
    return (*all_facts, *[before] * (elapsed_steps + 1 - len(all_facts)))


def _changing_facts(
    events: Sequence[Event], elapsed_steps: int
) -> list[tuple[int, frozenset[Fact]]]:
    """Return all facts that hold from step 0 and from each step with an event."""
    by_step: dict[int, list[Event]] = {0: []}
    for event in events:
        by_step.setdefault(event.step, []).append(event)
    now: set[Fact] = set()
    spans = []
    for step in sorted(step for step in by_step if 0 <= step <= elapsed_steps):
        for event in by_step[step]:
            (now.add if event.holds else now.remove)(event.fact)
        spans.append((step, frozenset(now)))
    return spans


def _intervals(events: Sequence[Event]) -> tuple[FactInterval, ...]:
    starts: dict[Fact, int] = {}
    intervals: list[FactInterval] = []
    for event in events:
        if event.holds:
            starts[event.fact] = event.step
        else:
            intervals.append(FactInterval(event.fact, starts.pop(event.fact), event.step))
    intervals += [FactInterval(fact, start, None) for fact, start in starts.items()]
    return tuple(sorted(intervals, key=lambda interval: (interval.start, interval.fact.kind)))


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
