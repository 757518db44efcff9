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

    @property
    def subject(self) -> str:
        """Name of the object that the fact is about."""
        return self.fact.subject

    @property
    def role(self) -> FactRole:
        """What the fact says about the hand and its object."""
        return self.fact.traits.role

    def lasts_until(self, step: int) -> bool:
        """Return whether the fact, once it holds, has not ceased before a step."""
        return self.end is None or self.end >= step


class Completion(NamedTuple):
    """A stage of the policy, by its index, and the step that completed it."""

    stage: int
    step: int


class Decision(NamedTuple):
    """How an episode ended for a goal.

    Attributes:
        judge: after the verdict, or the last step.
        step: of the verdict, or the last one; since the world began.
    """

    judge: Judge
    step: int


@dataclass(frozen=True, eq=False)
class EpisodeReplay:
    """One episode, step by step. Steps count since the world began.

    Two replays are never equal, so that one can be a key, as of the cache of `find_slips`.

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
        """Index of the policy's stage that is expected at the end, or at the verdict.

        The first one if the episode ended in the demonstration.
        """
        return max(self.judge.index - len(self.episode.demonstration), 0)

    @property
    def stages_left(self) -> range:
        """Indices of the policy's stages from the expected one to the last."""
        return range(self.expected_stage, len(self.stages))

    @property
    def acted_since(self) -> int:
        """The step at which an act last completed a stage, or else the policy's turn began.

        That time passes is no act.
        """
        since = self.policy_start_step
        for completion in self.completions():
            if facts_of(self.stages[completion.stage].expects):
                since = completion.step
        return since

    def completions(self) -> Iterator[Completion]:
        """Yield each completed stage of the policy, by its index, with the step that completed it.

        Expected stages 0, 0, 1 at steps 0, 1, 2 -> stage 0 was completed at step 1.
        """
        expected_stages = (*self.expected_stages, self.expected_stage)
        for step, (stage, next_stage) in enumerate(pairwise(expected_stages)):
            if stage >= 0 and stage != next_stage:  # negative in the demonstration
                yield Completion(stage, step)

    def started(self, *roles: FactRole, after: int | None = None) -> Iterator[FactInterval]:
        """Yield when facts of some roles held: of those that began later than a step.

        The roles say what a fact is about, such as the grip of the hand. By default, yields the
        facts that began in the policy's turn.
        """
        if after is None:
            after = self.policy_start_step
        for interval in self.intervals:
            if interval.start > after and interval.role in roles:
                yield interval

    def tried(self, kind: FactKind, subject: str | None = None) -> Iterator[FactInterval]:
        """Yield the attempts of a kind in the policy's turn, with one subject or with any."""
        for attempt in self.attempts:
            if attempt.fact.kind != kind or attempt.start <= self.policy_start_step:
                continue
            if subject in (None, attempt.subject):
                yield attempt

    def end_of(self, interval: FactInterval) -> int:
        """Return the step at which an interval ends: the last one if its fact still holds."""
        return self.last_step if interval.end is None else interval.end

    def stage_at(self, step: int) -> Stage:
        """Return the policy's stage that was tested at a step, or its first before its turn."""
        index = max(self.expected_stages[step], 0)
        return self.stages[min(index, len(self.stages) - 1)]

    def roles_at(self, step: int) -> set[FactRole]:
        """Return the roles of all facts that hold at a step."""
        return {fact.traits.role for fact in self.facts[step]}

    def unmet(self) -> tuple[Fact, ...]:
        """Return the facts that the current stage expects and that do not hold at the end.

        If it expects that both buttons have been pressed and the left one was, that is the press of
        the right one.
        """
        history = FactHistory()
        for step, facts in enumerate(self.facts):
            history.update(step, facts)

        expects = self.stages[self.expected_stage].expects
        parts: tuple[Condition, ...] = expects.of if isinstance(expects, All) else (expects,)
        unmet: list[Fact] = []
        for part in parts:
            if not history.holds(part):
                unmet += facts_of(part)
        return tuple(unmet)


def rejudge(
    episode: Episode,
    events: Sequence[Event],
    policy_start_step: int,
    elapsed_steps: int,
    attempts: Sequence[Event] = (),
) -> EpisodeReplay:
    """Judge an episode again by all its events, in order, and return what held at each step.

    Events are facts that began or ceased to hold; all steps count since the world began. The judge
    evaluates only steps at which something may change; between two of them, every step has the same
    expected stage.
    """
    judge = Judge.of(episode)
    expected_stage = -len(episode.demonstration)
    expected_stages: list[int] = []
    for step in _evaluated_steps(judge, events, elapsed_steps):
        # The evaluation at the step itself still tests the stage that was expected before.
        expected_stages += [expected_stage] * (step + 1 - len(expected_stages))
        expected_stage = judge.index - len(episode.demonstration)
    expected_stages += [expected_stage] * (elapsed_steps + 1 - len(expected_stages))

    return EpisodeReplay(
        episode,
        policy_start_step,
        tuple(expected_stages),
        facts_by_step(events, elapsed_steps),
        _intervals(events),
        judge,
        _intervals(attempts),
    )


def decide(episode: Episode, events: Sequence[Event], elapsed_steps: int) -> Decision:
    """Judge an episode again up to its verdict; faster than `rejudge`."""
    judge = Judge.of(episode)
    for step in _evaluated_steps(judge, events, elapsed_steps):
        if judge.status is not Status.ONGOING:
            return Decision(judge, step)
    return Decision(judge, elapsed_steps)


def completed_stages(
    episode: Episode, events: Sequence[Event], elapsed_steps: int
) -> dict[int, int]:
    """Return the step that completed each stage of the policy: ``{0: 40, 1: 95}``.

    Keys are indices of stages. Faster than `rejudge`.
    """
    judge = Judge.of(episode)
    steps: dict[int, int] = {}
    for step in _evaluated_steps(judge, events, elapsed_steps):
        last_completed = judge.index - len(episode.demonstration) - 1
        if last_completed >= 0:
            steps.setdefault(last_completed, step)
        if judge.status is not Status.ONGOING:
            break
    return steps


def _evaluated_steps(judge: Judge, events: Sequence[Event], elapsed_steps: int) -> Iterator[int]:
    """Let a judge evaluate each step at which anything may change, and yield the step.

    These are the steps with an event, a fact that begins or ceases to hold, and those at which a
    time that a condition asks for is over.
    """
    for span in _spans(events, elapsed_steps):
        next_step: float = span.start
        while next_step < span.end:
            step = int(next_step)
            judge.update(step, span.facts)
            yield step
            next_step = judge.next_change()


def facts_by_step(events: Sequence[Event], elapsed_steps: int) -> tuple[frozenset[Fact], ...]:
    """Return all facts that hold after 0, 1, ... `elapsed_steps` steps, a set for each.

    Steps without an event, a fact that begins or ceases to hold, share one set.
    """
    all_facts: list[frozenset[Fact]] = []
    for span in _spans(events, elapsed_steps):
        all_facts += [span.facts] * (span.end - span.start)
    return tuple(all_facts)


class _Span(NamedTuple):
    """The steps between two events, or before and after all.

    Attributes:
        start: the first step.
        end: the first step after them.
        facts: all that hold at each of them.
    """

    start: int
    end: int
    facts: frozenset[Fact]


def _spans(events: Sequence[Event], elapsed_steps: int) -> list[_Span]:
    """Return the spans of steps in which the same facts hold, from step 0 to `elapsed_steps`.

    A new span begins at each step with an event, a fact that begins or ceases to hold. Events at 3
    and 7 of 10 steps -> the spans 0 to 2, 3 to 6 and 7 to 10.
    """
    events_by_step: dict[int, list[Event]] = {0: []}
    for event in events:
        events_by_step.setdefault(event.step, []).append(event)
    starts = sorted(step for step in events_by_step if 0 <= step <= elapsed_steps)
    facts_now = set()
    spans = []
    for start, end in pairwise((*starts, elapsed_steps + 1)):
        for event in events_by_step[start]:
            if event.holds:
                facts_now.add(event.fact)
            else:
                facts_now.remove(event.fact)
        spans.append(_Span(start, end, frozenset(facts_now)))
    return spans


def _intervals(events: Sequence[Event]) -> tuple[FactInterval, ...]:
    """Return from when to when each fact held, in the order of the first steps.

    An event is a fact that begins or ceases to hold at a step. A fact that begins at step 3 and
    ceases at 7 -> 3 to 7; one that never ceases ends with None.
    """
    start_by_fact = {}
    intervals = []
    for event in events:
        if event.holds:
            start_by_fact[event.fact] = event.step
        else:
            intervals.append(FactInterval(event.fact, start_by_fact.pop(event.fact), event.step))
    intervals += [FactInterval(fact, start, None) for fact, start in start_by_fact.items()]
    return tuple(sorted(intervals, key=lambda interval: (interval.start, interval.fact.kind)))


class Event(NamedTuple):
    """A fact that started to hold (`holds`) or ceased to, at the evaluation after `step` steps."""

    step: int
    fact: Fact
    holds: bool

    def as_dict(self) -> dict[str, str | int | bool | None]:
        """Return the event as plain JSON values, for records."""
        return {"step": self.step, **self.fact._asdict(), "holds": self.holds}


def changes(step: int, before: AbstractSet[Fact], now: AbstractSet[Fact]) -> tuple[Event, ...]:
    """Return the events between two evaluations: first the facts that ceased, then the new ones."""
    started = [Event(step, fact, True) for fact in sorted(now - before, key=_order)]
    ceased = [Event(step, fact, False) for fact in sorted(before - now, key=_order)]
    return (*ceased, *started)


def _order(fact: Fact) -> tuple[str, str, str]:
    return fact.kind, fact.subject, fact.place or ""
