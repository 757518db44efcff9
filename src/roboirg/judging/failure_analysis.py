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
from roboirg.core.fact_traits import FactRole
from roboirg.core.failures import FailureName
from roboirg.judging.declared_intent import DeclaredIntent
from roboirg.judging.end_state import (
    describe_end_state,
    describe_slip,
    explain_early_act,
    judge_moment,
)
from roboirg.judging.episode_replay import EpisodeReplay, Event, FactInterval, rejudge
from roboirg.judging.fact_history import FactHistory
from roboirg.judging.failure_attribution import FailureAttribution
from roboirg.judging.grounding_errors import classify_grounding_error
from roboirg.judging.judge import Status, describe_violation
from roboirg.judging.slips import drop_before, find_slips

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

    @property
    def failure(self) -> FailureName | None:
        """The name that its rule has for the failure; None if it has none, and for a fact."""
        return self.violation.failure if isinstance(self.violation, Rule) else None


def attribute_failure(
    episode: Episode,
    events: Sequence[Event],
    *,
    timed_out: bool,
    policy_start_step: int,
    elapsed_steps: int,
    cause: str | None = None,
    mirrored: MirroredObjects | None = None,
    attempts: Sequence[Event] = (),
    intent: DeclaredIntent | None = None,
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
        attempts: all changes of facts of attempts, in order, like `events`.
        intent: what the policy declared, which comes before what it did; None if it did not.
    """
    replay = rejudge(episode, events, policy_start_step, elapsed_steps, attempts)
    has_ended = replay.judge.violation or timed_out or cause is not None
    if replay.judge.status is Status.SUCCESS or not has_ended:
        return None
    first = min(_deviations(replay), key=lambda one: one.step, default=None)
    if first is not None and first.act is not None:
        found = _attribute_act(replay, first, first.act)
    elif first is None and not timed_out:
        found = FailureAttribution.of(
            "unreachable", None, replay.last_step, f"could not reach a pose: {cause}"
        )
    else:
        found = describe_end_state(replay)
        if first is not None and found.failure == "out_of_time":
            words = _describe_deviation(replay, first)
            found = FailureAttribution.of(first.failure or "out_of_time", None, first.step, words)
    act = None if first is None else first.act
    found = refine_wrong_object(found, replay, mirrored or {}, None if act is None else act.place)
    found = found._replace(step=found.step - policy_start_step)
    return found if intent is None else intent.revise(found, episode)


def _attribute_act(replay: EpisodeReplay, deviation: _Deviation, act: Fact) -> FailureAttribution:
    """Return the failure of a forbidden act, or the slips that explain it."""
    slips, step = find_slips(replay), deviation.step
    failure = deviation.failure
    if failure == "mistimed":
        failure = judge_moment(replay, step)
    dropped = drop_before(slips, FactInterval(act, step, None))
    if act.traits.role is FactRole.PLACING and dropped is not None:
        return describe_slip(replay, dropped)
    if act.traits.role is FactRole.PRESS and _is_touched(replay, step):
        failure = "ambiguous_act"
    if failure is None:
        explained = explain_early_act(replay, slips, act) if step == replay.last_step else None
        if explained is not None:
            return explained
        failure = classify_grounding_error(act, replay.stages, max(replay.expected_stages[step], 0))
    return FailureAttribution.of(failure, act.subject, step, _describe_deviation(replay, deviation))


def _is_touched(replay: EpisodeReplay, step: int) -> bool:
    """Return whether something in the hand, and next to the button, pressed it."""
    roles = {fact.traits.role for fact in replay.facts[step]}
    return roles & {FactRole.GRIP, FactRole.APPROACH} == {FactRole.GRIP}


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


def _describe_deviation(replay: EpisodeReplay, deviation: _Deviation) -> str:
    stage, scene = replay.stage_at(deviation.step), replay.episode.scene
    return describe_violation(deviation.violation, stage, scene)


def refine_wrong_object(
    found: FailureAttribution, replay: EpisodeReplay, mirrored: MirroredObjects, place: str | None
) -> FailureAttribution:
    """Return a ``mirrored_pick`` if the wrong object or place is the mirrored one.

    The image is that of the object that the words mean and the current stage expects, or of any
    that they mean if it expects none of them.
    The step of `found` counts since the world began; `place` is None if the act has none.
    """
    if found.failure not in ("wrong_object", "wrong_place"):
        return found
    facts = facts_of(replay.stage_at(found.step).expects)
    names = {str(name) for fact in facts for name in (fact.subject, fact.place)}
    sides = {other for name in names & mirrored.keys() or mirrored for other in mirrored[name]}
    if not sides & {found.subject, place}:
        return found
    words = f"{found.sentence[:-1]}; the words mean it only with left and right exchanged"
    return FailureAttribution.of("mirrored_pick", found.subject, found.step, words)
