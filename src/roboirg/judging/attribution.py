"""Attribute a failed episode to a cause, from its events alone (docs/attribution.md).

Two kinds. A grounding failure: something else was done than what was meant. An execution failure:
what was meant was not brought off. The first thing that could not be made good any more decides;
if there is none, what the end looks like. It sees acts, not intentions.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple

from roboirg.core.conditions import (
    LASTING_KINDS,
    All,
    Condition,
    Elapsed,
    Fact,
    FactCount,
    OccurrenceCount,
    Rule,
    facts_of,
)
from roboirg.core.episode import Episode
from roboirg.judging.end_state import describe_end_state
from roboirg.judging.episode_replay import EpisodeReplay, FactInterval, rejudge
from roboirg.judging.events import Event
from roboirg.judging.fact_history import FactHistory
from roboirg.judging.failure_attribution import FailureAttribution, FailureName
from roboirg.judging.grounding_errors import classify_grounding_error
from roboirg.judging.judge import Status, describe_violation
from roboirg.judging.release_errors import find_excusing_release


class _Deviation(NamedTuple):
    """The first moment at which something forbidden could not be avoided any more.

    Attributes:
        step: since the world began.
        broken: what was, or was going to be, broken.
        fact: the act that did it; None if it was time that passed.
    """

    step: int
    broken: Fact | Rule
    fact: Fact | None


def attribute_failure(
    episode: Episode,
    events: Sequence[Event],
    *,
    timed_out: bool,
    turn: int,
    elapsed: int,
    cause: str | None = None,
) -> FailureAttribution | None:
    """Say why an episode failed.

    Args:
        episode: which.
        events: all that changed since the world began, in order, their steps counted from there.
        timed_out: whether the policy's steps were used up before a verdict.
        turn: control steps of the world before the policy's turn (``elapsed_steps`` at reset).
        elapsed: control steps of the world in all (``elapsed_steps`` at the end).
        cause: the recorded cause. Where the events broke no rule and time was not up, somebody
            else ended the episode: a pose could not be reached.

    Returns:
        None if it did not fail.
    """
    trace = rejudge(episode, events, turn, elapsed)
    over = timed_out or cause is not None
    if trace.judge.status is Status.SUCCESS or not (trace.judge.broken or over):
        return None
    first = min(_deviations(trace), key=lambda one: one.step, default=None)
    if first is not None and first.fact is not None:
        found = _of_act(trace, first, first.fact)
    elif first is None and not timed_out:
        found = FailureAttribution.of(
            "unreachable", None, trace.end, f"a pose could not be reached: {cause}"
        )
    else:
        found = describe_end_state(trace)
        if first is not None and found.failure == "out_of_time":
            found = _of_time(trace, first)
    return found._replace(step=found.step - turn)


def _of_act(trace: EpisodeReplay, deviation: _Deviation, fact: Fact) -> FailureAttribution:
    """What it means that something was done that must not be."""
    failure, due = _failure_of(deviation.broken), max(trace.dues[deviation.step], 0)
    if failure is None:
        slip = find_excusing_release(trace, fact) if deviation.step == trace.end else None
        if slip is not None:
            return slip
        failure = classify_grounding_error(fact, trace.stages, due)
    return FailureAttribution.of(failure, fact.subject, deviation.step, _words(trace, deviation))


def _of_time(trace: EpisodeReplay, deviation: _Deviation) -> FailureAttribution:
    """What it means that something was not done in time, and nothing else was wrong."""
    failure = _failure_of(deviation.broken) or "out_of_time"
    return FailureAttribution.of(failure, None, deviation.step, _words(trace, deviation))


def _deviations(trace: EpisodeReplay) -> Iterator[_Deviation]:
    """What was going to be broken, and what was; where it is the same step, the former."""
    yield from _lasting(trace)
    for rule in _rules(trace):
        yield from _wasted(trace, rule)
    broken = trace.judge.broken
    if broken is not None:
        yield _Deviation(trace.end, broken, _act(trace, broken, trace.end))


def _lasting(trace: EpisodeReplay) -> Iterator[_Deviation]:
    """Rules of what is due, or will be, that have come to hold for good."""
    history, last = FactHistory(), _rules(trace)
    for step, facts in enumerate(trace.facts):
        fresh = facts is not history.facts
        history.follow(step, facts)
        if not fresh or step <= trace.turn:
            continue
        for rule in [rule for rule, stage in last.items() if stage >= trace.dues[step]]:
            if _lasts(rule.condition) and history.holds(rule.condition):
                del last[rule]
                yield _Deviation(step, rule, _act(trace, rule, step))


def _wasted(trace: EpisodeReplay, rule: Rule) -> Iterator[_Deviation]:
    """A beginning that counts towards a limit, when all that the limit leaves are still needed."""
    if not isinstance(rule.condition, OccurrenceCount) or rule.condition.until is not None:
        return
    counted = rule.condition.facts
    needed = sum(stage.expects in counted for stage in trace.stages)
    spare = rule.condition.least - 1 - needed
    spells = [spell for spell in trace.spells if spell.fact in counted]
    wasted = [spell for spell in spells if not _used(trace, spell)]
    if 0 <= spare < len(wasted) and wasted[spare].begin > trace.turn:
        yield _Deviation(wasted[spare].begin, rule, wasted[spare].fact)


def _used(trace: EpisodeReplay, spell: FactInterval) -> bool:
    """Whether a stage was completed by it."""
    end = trace.end + 1 if spell.end is None else spell.end
    completed = map(trace.completed, range(spell.begin, end))
    return any(stage is not None and stage.expects == spell.fact for stage in completed)


def _rules(trace: EpisodeReplay) -> dict[Rule, int]:
    """All rules, each with the last stage in which it is in force."""
    return {
        one: index
        for index, stage in enumerate(trace.stages)
        for one in stage.forbids
        if isinstance(one, Rule)
    }


def _lasts(condition: Condition) -> bool:
    """Whether a condition that holds will hold for ever, because of what was done."""
    match condition:
        case Fact():
            return condition.kind in LASTING_KINDS
        case FactCount(facts, _, most):
            return most is None and all(map(_lasts, facts))
        case OccurrenceCount():
            return True
        case All(of):
            return all(map(_lasts, of))
        case Elapsed():
            return False


def _act(trace: EpisodeReplay, broken: Fact | Rule, step: int) -> Fact | None:
    """What was done last of that by which something is broken; None if nothing was done."""
    facts = facts_of(broken)
    begun = [s for s in trace.spells if s.fact in facts and s.begin <= step]
    holding = [s for s in begun if s.end is None or s.end > step]
    return max(holding or begun, key=lambda spell: spell.begin).fact if begun else None


def _failure_of(broken: Fact | Rule) -> FailureName | None:
    return broken.failure if isinstance(broken, Rule) else None


def _words(trace: EpisodeReplay, deviation: _Deviation) -> str:
    due = trace.stages[max(trace.dues[deviation.step], 0)]
    return describe_violation(deviation.broken, due, trace.episode.scene)
