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
    has_failed = replay.judge.violation is not None or timed_out or cause is not None
    if replay.judge.status is Status.SUCCESS or not has_failed:
        return None

    # The first deviation comes before the end, as what follows it can no longer succeed.
    deviation = min(_deviations(replay), key=lambda deviation: deviation.step, default=None)
    act = None if deviation is None else deviation.act
    if deviation is None:
        found = _attribute_end(replay, timed_out=timed_out, cause=cause)
    elif act is None:
        found = _attribute_time(replay, deviation)
    else:
        found = _attribute_act(replay, deviation, act)

    place = None if act is None else act.place
    found = refine_wrong_object(found, replay, mirrored or {}, place)
    # Up to here, steps count since the world began; a declaration counts them in the policy's turn.
    found = found._replace(step=found.step - policy_start_step)
    return found if intent is None else intent.revise(found, episode)


def _attribute_end(
    replay: EpisodeReplay, *, timed_out: bool, cause: str | None
) -> FailureAttribution:
    """Return the failure of an episode without a deviation: what the policy had not done yet.

    If the time was not over, the environment ended the episode, with a cause.
    """
    if timed_out:
        return describe_end_state(replay)
    words = f"could not reach a pose: {cause}"
    return FailureAttribution.of("unreachable", None, replay.last_step, words)


def _attribute_time(replay: EpisodeReplay, deviation: _Deviation) -> FailureAttribution:
    """Return the failure of letting time pass: what was tried until then, if anything was."""
    found = describe_end_state(replay)
    if found.failure != "out_of_time":
        return found
    words = _describe_deviation(replay, deviation)
    return FailureAttribution.of(deviation.failure or "out_of_time", None, deviation.step, words)


def _attribute_act(replay: EpisodeReplay, deviation: _Deviation, act: Fact) -> FailureAttribution:
    """Return the failure of a forbidden act, or the slips that explain it.

    A red cube on the wrong disc -> ``wrong_place``; if it fell there -> ``dropped``. A failure that
    the violated rule names stays, but for presses: these depend on their moment, and on whether the
    hand meant to press at all.
    """
    step = deviation.step
    slips = find_slips(replay)
    dropped = drop_before(slips, FactInterval(act, step, None))
    if act.traits.role is FactRole.PLACING and dropped is not None:
        return describe_slip(replay, dropped)

    failure = deviation.failure
    if failure == "mistimed":
        failure = judge_moment(replay, step)
    if act.traits.role is FactRole.PRESS and _is_pressed_by_held(replay, step):
        failure = "ambiguous_act"

    # Explanations look at the end of the replay, so they fit an act that ended it.
    if failure is None and step == replay.last_step:
        explained = explain_early_act(replay, slips, act)
        if explained is not None:
            return explained
    if failure is None:
        expected_stage = max(replay.expected_stages[step], 0)
        failure = classify_grounding_error(act, replay.stages, expected_stage)
    words = _describe_deviation(replay, deviation)
    return FailureAttribution.of(failure, act.subject, step, words)


def _is_pressed_by_held(replay: EpisodeReplay, step: int) -> bool:
    """Return whether a held object, not the hand, pressed the button: the hand is not at it."""
    roles = {fact.traits.role for fact in replay.facts[step]}
    return FactRole.GRIP in roles and FactRole.APPROACH not in roles


def _deviations(replay: EpisodeReplay) -> Iterator[_Deviation]:
    """Yield the violations that became certain, then the one that occurred."""
    yield from _lasting_deviations(replay)
    for rule in _last_stages(replay):
        yield from _wasted_occurrences(replay, rule)
    violation = replay.judge.violation
    if violation is not None:
        act = _latest_act(replay, violation, replay.last_step)
        yield _Deviation(replay.last_step, violation, act)


def _lasting_deviations(replay: EpisodeReplay) -> Iterator[_Deviation]:
    """Yield the rules of current and later stages whose conditions come to hold for good.

    A third red cube falls into the bin where the goal has two: a cube never leaves the bin, so the
    rule of the last stage is already sure to be violated. Each rule is yielded once.
    """
    history = FactHistory()
    open_rules = _last_stages(replay)
    for step, facts in enumerate(replay.facts):
        has_changed = facts is not history.facts  # steps without an event share one set
        history.update(step, facts)
        if not has_changed or step <= replay.policy_start_step:
            continue
        for rule, last_stage in list(open_rules.items()):
            is_in_force = last_stage >= replay.expected_stages[step]
            if is_in_force and _lasts(rule.condition) and history.holds(rule.condition):
                del open_rules[rule]
                yield _Deviation(step, rule, _latest_act(replay, rule, step))


def _wasted_occurrences(replay: EpisodeReplay, rule: Rule) -> Iterator[_Deviation]:
    """Yield the first occurrence too many for a limit, given those that the stages need.

    A rule that fails at five swings over a target, where the stages need three, leaves one to
    waste: four are allowed. The second swing that completes no stage is the first too many, since
    the three that are still needed will then be five in all.
    """
    limit = rule.condition
    if not isinstance(limit, OccurrenceCount) or limit.until is not None:
        return
    most_allowed = limit.least - 1
    needed = sum(stage.expects in limit.facts for stage in replay.stages)
    may_be_wasted = most_allowed - needed
    occurrences = [interval for interval in replay.intervals if interval.fact in limit.facts]
    wasted = [interval for interval in occurrences if not _completes_stage(replay, interval)]
    if not 0 <= may_be_wasted < len(wasted):
        return
    too_many = wasted[may_be_wasted]
    if too_many.start > replay.policy_start_step:
        yield _Deviation(too_many.start, rule, too_many.fact)


def _completes_stage(replay: EpisodeReplay, interval: FactInterval) -> bool:
    """Return whether a fact that a stage expected completed it while it held."""
    for stage, step in replay.completions():
        is_expected = replay.stages[stage].expects == interval.fact
        # At the step at which it ends, the fact no longer holds.
        if is_expected and interval.start <= step and interval.lasts_until(step + 1):
            return True
    return False


def _last_stages(replay: EpisodeReplay) -> dict[Rule, int]:
    """Return all rules, each with the index of the last stage in which it is in force."""
    last_stages: dict[Rule, int] = {}
    for index, stage in enumerate(replay.stages):
        for forbidden in stage.forbids:
            if isinstance(forbidden, Rule):
                last_stages[forbidden] = index
    return last_stages


def _lasts(condition: Condition) -> bool:
    """Return whether a condition, once an act has met it, holds for good."""
    match condition:
        case Fact():
            return condition.traits.lasts
        case FactCount(facts, _, most):
            return most is None and all(fact.traits.lasts for fact in facts)
        case OccurrenceCount():
            return True
        case All(parts):
            return all(_lasts(part) for part in parts)
        case Elapsed():
            return False


def _latest_act(replay: EpisodeReplay, violation: Fact | Rule, step: int) -> Fact | None:
    """Return the latest of the acts that make a violation; None if it is only the time.

    Acts whose fact still holds at the step come first.
    """
    facts = facts_of(violation)
    acts = [act for act in replay.intervals if act.fact in facts and act.start <= step]
    if not acts:
        return None
    still_holding = [act for act in acts if act.lasts_until(step + 1)]
    latest = max(still_holding or acts, key=lambda act: act.start)
    return latest.fact


def _describe_deviation(replay: EpisodeReplay, deviation: _Deviation) -> str:
    """Return a deviation in words: *pressed the button too early; expected: pick up the cube*."""
    stage = replay.stage_at(deviation.step)
    return describe_violation(deviation.violation, stage, replay.episode.scene)


def refine_wrong_object(
    found: FailureAttribution, replay: EpisodeReplay, mirrored: MirroredObjects, place: str | None
) -> FailureAttribution:
    """Return a ``mirrored_pick`` if the wrong object or place is the mirrored one.

    *The left cube* means the red one, and with left and right exchanged the blue one: taking the
    blue cube is a mirrored pick. What counts are the mirror images of the objects that the words
    mean and the current stage expects, or of all that the words mean if it expects none of them.

    Args:
        found: the failure so far; its step counts since the world began.
        replay: of the episode.
        mirrored: the mirror images of each object that the words mean.
        place: where the act was; None if it has no place.
    """
    if found.failure not in ("wrong_object", "wrong_place"):
        return found
    expected: set[str | None] = set()
    for fact in facts_of(replay.stage_at(found.step).expects):
        expected.update((fact.subject, fact.place))
    meant_and_expected = [name for name in mirrored if name in expected]

    mirror_images: set[str | None] = set()
    for name in meant_and_expected or mirrored:
        mirror_images.update(mirrored[name])
    if mirror_images.isdisjoint((found.subject, place)):
        return found
    words = f"{found.sentence[:-1]}; the words mean it only with left and right exchanged"
    return FailureAttribution.of("mirrored_pick", found.subject, found.step, words)
