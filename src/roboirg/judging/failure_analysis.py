"""Attribute a failed episode to a cause, from its events alone (docs/attribution.md).

There are two kinds. Grounding failure: the policy did something else than the instruction means.
Execution failure: it did not complete what the instruction means. The first deviation that cannot
be undone decides; if there is none, the end of the episode does. The analysis sees acts, not
intentions.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from typing import NamedTuple

from roboirg.core.conditions import (
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
from roboirg.core.failures import FailureName
from roboirg.judging.end_state import describe_end_state
from roboirg.judging.episode_replay import EpisodeReplay, Event, FactInterval, rejudge
from roboirg.judging.fact_history import FactHistory
from roboirg.judging.failure_attribution import FailureAttribution
from roboirg.judging.grounding_errors import classify_grounding_error
from roboirg.judging.judge import Status, describe_violation
from roboirg.judging.release_errors import find_excusing_release

MirroredObjects = Mapping[str, Collection[str]]
"""For each object that an instruction means, those that it would mean with left and right
exchanged."""


class _Deviation(NamedTuple):
    """The first moment from which on a violation cannot be avoided.

    Attributes:
        step: since the world began.
        violation: what is, or will be, violated.
        act: the fact that does it; None if it is the time that passes.
    """

    step: int
    violation: Fact | Rule
    act: Fact | None


def attribute_failure(
    episode: Episode,
    events: Sequence[Event],
    *,
    timed_out: bool,
    policy_start_step: int,
    elapsed_steps: int,
    cause: str | None = None,
    mirrored: MirroredObjects | None = None,
) -> FailureAttribution | None:
    """Return why an episode failed; None if it did not fail.

    Args:
        episode: the episode.
        events: all changes since the world began, in order, their steps counted from there.
        timed_out: whether the policy used up its steps before a verdict.
        policy_start_step: control steps of the world before the policy's turn (``elapsed_steps``
            at reset).
        elapsed_steps: control steps of the world in all (``elapsed_steps`` at the end).
        cause: the recorded cause. If the events violate no rule and the policy did not time out,
            the environment ended the episode: the arm could not reach a pose.
        mirrored: for each object that the instruction means, those that it would mean with left
            and right exchanged (`roboirg.language.mirrored_objects`); None finds no mirrored picks.
    """
    replay = rejudge(episode, events, policy_start_step, elapsed_steps)
    ended = timed_out or cause is not None
    if replay.judge.status is Status.SUCCESS or not (replay.judge.violation or ended):
        return None
    first = min(_deviations(replay), key=lambda one: one.step, default=None)
    if first is not None and first.act is not None:
        found = _attribute_act(replay, first, first.act)
    elif first is None and not timed_out:
        words = f"could not reach a pose: {cause}"
        found = FailureAttribution.of("unreachable", None, replay.last_step, words)
    else:
        found = describe_end_state(replay)
        if first is not None and found.failure == "out_of_time":
            found = _attribute_time(replay, first)
    act = None if first is None else first.act
    found = refine_wrong_object(found, replay, mirrored or {}, None if act is None else act.place)
    return found._replace(step=found.step - policy_start_step)


def _attribute_act(replay: EpisodeReplay, deviation: _Deviation, act: Fact) -> FailureAttribution:
    """Return the failure of a forbidden act."""
    failure = _failure_of(deviation.violation)
    if failure is None:
        if deviation.step == replay.last_step:
            release = find_excusing_release(replay, act)
            if release is not None:
                return release
        stage = max(replay.expected_stages[deviation.step], 0)
        failure = classify_grounding_error(act, replay.stages, stage)
    return FailureAttribution.of(
        failure, act.subject, deviation.step, _describe_deviation(replay, deviation)
    )


def _attribute_time(replay: EpisodeReplay, deviation: _Deviation) -> FailureAttribution:
    """Return the failure of a missed deadline, if nothing else was wrong."""
    failure = _failure_of(deviation.violation) or "out_of_time"
    words = _describe_deviation(replay, deviation)
    return FailureAttribution.of(failure, None, deviation.step, words)


def _deviations(replay: EpisodeReplay) -> Iterator[_Deviation]:
    """Yield the violations that became certain, then the one that occurred."""
    yield from _lasting_deviations(replay)
    for rule in _last_stages(replay):
        yield from _wasted_occurrences(replay, rule)
    violation = replay.judge.violation
    if violation is not None:
        step = replay.last_step
        yield _Deviation(step, violation, _latest_act(replay, violation, step))


def _lasting_deviations(replay: EpisodeReplay) -> Iterator[_Deviation]:
    """Yield the rules of current and later stages whose conditions come to hold for good."""
    history, last_stages = FactHistory(), _last_stages(replay)
    for step, facts in enumerate(replay.facts):
        changed = facts is not history.facts
        history.update(step, facts)
        if not changed or step <= replay.policy_start_step:
            continue
        current = replay.expected_stages[step]
        for rule in [rule for rule, stage in last_stages.items() if stage >= current]:
            if _lasts(rule.condition) and history.holds(rule.condition):
                del last_stages[rule]
                yield _Deviation(step, rule, _latest_act(replay, rule, step))


def _wasted_occurrences(replay: EpisodeReplay, rule: Rule) -> Iterator[_Deviation]:
    """Yield the first occurrence too many for a limit, given those that the stages still need."""
    if not isinstance(rule.condition, OccurrenceCount) or rule.condition.until is not None:
        return
    counted = rule.condition.facts
    needed = sum(stage.expects in counted for stage in replay.stages)
    spare = rule.condition.least - 1 - needed
    occurrences = [interval for interval in replay.intervals if interval.fact in counted]
    wasted = [interval for interval in occurrences if not _completes_stage(replay, interval)]
    if 0 <= spare < len(wasted) and wasted[spare].start > replay.policy_start_step:
        yield _Deviation(wasted[spare].start, rule, wasted[spare].fact)


def _completes_stage(replay: EpisodeReplay, interval: FactInterval) -> bool:
    end = replay.last_step + 1 if interval.end is None else interval.end
    return any(
        interval.start <= step < end and replay.stages[stage].expects == interval.fact
        for stage, step in replay.completions()
    )


def _last_stages(replay: EpisodeReplay) -> dict[Rule, int]:
    """Return all rules, each with the last stage in which it is in force."""
    return {
        one: index
        for index, stage in enumerate(replay.stages)
        for one in stage.forbids
        if isinstance(one, Rule)
    }


def _lasts(condition: Condition) -> bool:
    """Return whether a condition, once an act has met it, holds for good."""
    match condition:
        case Fact():
            return condition.traits.lasts
        case FactCount(facts, _, most):
            return most is None and all(map(_lasts, facts))
        case OccurrenceCount():
            return True
        case All(of):
            return all(map(_lasts, of))
        case Elapsed():
            return False


def _latest_act(replay: EpisodeReplay, violation: Fact | Rule, step: int) -> Fact | None:
    """Return the latest of the acts that make a violation; None if it is only the time."""
    facts = facts_of(violation)
    acts = [one for one in replay.intervals if one.fact in facts and one.start <= step]
    holding = [one for one in acts if one.end is None or one.end > step]
    return max(holding or acts, key=lambda interval: interval.start).fact if acts else None


def _failure_of(violation: Fact | Rule) -> FailureName | None:
    return violation.failure if isinstance(violation, Rule) else None


def _describe_deviation(replay: EpisodeReplay, deviation: _Deviation) -> str:
    stage = replay.stages[max(replay.expected_stages[deviation.step], 0)]
    return describe_violation(deviation.violation, stage, replay.episode.scene)


def refine_wrong_object(
    found: FailureAttribution, replay: EpisodeReplay, mirrored: MirroredObjects, place: str | None
) -> FailureAttribution:
    """Return a ``mirrored_pick`` if the wrong object or place is the mirrored one.

    Whose mirror image counts depends on the stages: that of the object that the words mean and the
    current stage expects; without one, of the nearest stage before it, or else after it.
    The step of `found` counts since the world began; `place` is None if the act has none.
    """
    if found.failure not in ("wrong_object", "wrong_place"):
        return found
    meant = _meant_objects(replay, mirrored, max(replay.expected_stages[found.step], 0))
    sides = {other for name in meant for other in mirrored[name]}
    if not sides & {found.subject, place}:
        return found
    words = f"{found.sentence[:-1]}; the words mean it only with left and right exchanged"
    return FailureAttribution.of("mirrored_pick", found.subject, found.step, words)


def _meant_objects(
    replay: EpisodeReplay, mirrored: MirroredObjects, current: int
) -> frozenset[str]:
    """Return the keys of `mirrored` that the current stage expects, or one before, or one after."""
    stages = replay.stages
    for stage in (*reversed(stages[: current + 1]), *stages[current + 1 :]):
        facts = facts_of(stage.expects)
        names = {name for fact in facts for name in (fact.subject, fact.place)}
        if meant := names & mirrored.keys():
            return frozenset(name for name in meant if name is not None)
    return frozenset()
