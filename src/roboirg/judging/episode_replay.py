"""What happened in a whole episode, found again from its events: a second run of the judge."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import NamedTuple

from roboirg.core.conditions import All, Condition, Fact, facts_of
from roboirg.core.episode import Episode, Stage
from roboirg.judging.events import Event
from roboirg.judging.fact_history import FactHistory
from roboirg.judging.judge import Judge

GRIPS = ("picked", "lifted", "held")
"""Facts of something that is in the hand."""


class FactInterval(NamedTuple):
    """A fact held from one evaluation to another.

    Attributes:
        fact: which.
        begin: the first step at which it held.
        end: the first at which it no longer did; None if it held to the last.
    """

    fact: Fact
    begin: int
    end: int | None


@dataclass(frozen=True)
class EpisodeReplay:
    """One episode, step by step. Steps count since the world began.

    Attributes:
        episode: which.
        turn: steps of the world before the policy's turn.
        dues: at each step the index of the stage that was due when its evaluation began, counted
            from the policy's first stage (negative in the demonstration).
        facts: at each step all that held.
        spells: of all facts, in the order in which they began.
        judge: after the last evaluation.
    """

    episode: Episode
    turn: int
    dues: tuple[int, ...]
    facts: tuple[frozenset[Fact], ...]
    spells: tuple[FactInterval, ...]
    judge: Judge

    @property
    def end(self) -> int:
        """The last step."""
        return len(self.facts) - 1

    @property
    def stages(self) -> tuple[Stage, ...]:
        """Those of the policy."""
        return self.episode.stages

    @property
    def due(self) -> int:
        """Index of the stage that is due at the end, or at the verdict."""
        return self.judge.index - len(self.episode.demonstration)

    @property
    def due_since(self) -> int:
        """From which step on that stage was due in the policy's turn."""
        return max(self.dues.index(self.due) if self.due in self.dues else self.end, self.turn)

    def completed(self, step: int) -> Stage | None:
        """The policy's stage that was completed at a step, if one was."""
        due = self.dues[step]
        after = self.dues[step + 1] if step < self.end else self.due
        return self.stages[due] if 0 <= due < after else None

    def begun(self, *kinds: str, after: int) -> Iterator[FactInterval]:
        """What began later than a step, of some kinds."""
        return (s for s in self.spells if s.begin > after and s.fact.kind in kinds)

    def unmet(self) -> tuple[Fact, ...]:
        """The facts of all parts of what is due that are not met at the end."""
        history = FactHistory()
        for step, facts in enumerate(self.facts):
            history.follow(step, facts)
        expects = self.stages[self.due].expects
        parts: tuple[Condition, ...] = expects.of if isinstance(expects, All) else (expects,)
        return tuple(f for part in parts if not history.holds(part) for f in facts_of(part))


def rejudge(episode: Episode, events: Sequence[Event], turn: int, elapsed: int) -> EpisodeReplay:
    """Judge an episode again.

    Args:
        episode: which.
        events: all that changed since the world began.
        turn: steps of the world before the policy's turn.
        elapsed: steps of the world in all; the last evaluation was after it.
    """
    facts = facts_by_step(events, elapsed)
    judge = Judge((*episode.demonstration, *episode.stages), episode.scene)
    dues: list[int] = []
    for step, now in enumerate(facts):
        dues.append(judge.index - len(episode.demonstration))
        judge.update(step, now)
    return EpisodeReplay(episode, turn, tuple(dues), facts, _spells(events), judge)


def facts_by_step(events: Sequence[Event], elapsed: int) -> tuple[frozenset[Fact], ...]:
    """All that held, after 0 to `elapsed` steps."""
    by_step: dict[int, list[Event]] = {}
    for event in events:
        by_step.setdefault(event.step, []).append(event)
    now: frozenset[Fact] = frozenset()
    course: list[frozenset[Fact]] = []
    for step in range(elapsed + 1):
        for event in by_step.get(step, ()):
            now = now | {event.fact} if event.holds else now - {event.fact}
        course.append(now)
    return tuple(course)


def _spells(events: Sequence[Event]) -> tuple[FactInterval, ...]:
    open_: dict[Fact, int] = {}
    spells: list[FactInterval] = []
    for event in events:
        if event.holds:
            open_[event.fact] = event.step
        else:
            spells.append(FactInterval(event.fact, open_.pop(event.fact), event.step))
    spells += [FactInterval(fact, begin, None) for fact, begin in open_.items()]
    return tuple(sorted(spells, key=lambda spell: (spell.begin, spell.fact.kind)))
