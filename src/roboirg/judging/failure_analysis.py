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
from roboirg.core.episode import Episode, Stage
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
from roboirg.judging.slips import Slip, drop_before, unsteady_visit

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
    """Return why an episode failed, as one failure with a sentence; None if it did not fail.

    The first act, or lapse of time, after which it could no longer succeed decides; if there is
    none, the end of the episode does.

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
    if replay.judge.status is Status.SUCCESS:
        return None
    if replay.judge.violation is None and not timed_out and cause is None:
        return None

    # The first deviation comes before the end, as what follows it can no longer succeed.
    deviation = min(_deviations(replay), key=lambda deviation: deviation.step, default=None)
    if deviation is not None and deviation.act is not None:
        failure = _attribute_act(replay, deviation, deviation.act)
    elif deviation is not None:
        failure = _attribute_time(replay, deviation)
    elif timed_out:
        failure = describe_end_state(replay)
    else:  # the environment ended the episode, for example at a pose that the arm cannot reach
        words = f"could not reach a pose: {cause}"
        failure = FailureAttribution.of("unreachable", None, replay.last_step, words)
    failure = refine_wrong_object(failure, replay, mirrored or {}, deviation)
    # Up to here, steps count since the world began; a declaration counts them in the policy's turn.
    failure = failure._replace(step=failure.step - policy_start_step)
    if intent is None:
        return failure
    return intent.revise(failure, episode)


def _attribute_time(replay: EpisodeReplay, deviation: _Deviation) -> FailureAttribution:
    """Return the failure of letting time pass: what was tried until then, if anything was."""
    end_failure = describe_end_state(replay)
    if end_failure.failure != "out_of_time":
        return end_failure
    words = _describe_deviation(replay, deviation)
    return FailureAttribution.of(deviation.failure or "out_of_time", None, deviation.step, words)


def _attribute_act(replay: EpisodeReplay, deviation: _Deviation, act: Fact) -> FailureAttribution:
    """Return the failure of a forbidden act, or the failed tries that explain it.

    A red cube on the wrong disc -> ``wrong_place``; if it fell there -> ``dropped``. A failure that
    the violated rule names stays, but for presses: these depend on their moment, and on whether the
    hand meant to press at all.
    """
    step = deviation.step
    slip = _slip_behind(replay, FactInterval(act, step, None))
    if slip is not None:
        return describe_slip(replay, slip)
    failure = _failure_by_rule(replay, deviation, act)
    # Explanations look at the end of the replay, so they fit an act that ended it.
    if failure is None and step == replay.last_step:
        explained = explain_early_act(replay, act)
        if explained is not None:
            return explained
    if failure is None:
        expected_stage = max(replay.expected_stages[step], 0)
        failure = classify_grounding_error(act, replay.stages, expected_stage)
    words = _describe_deviation(replay, deviation)
    return FailureAttribution.of(failure, act.subject, step, words)


def _slip_behind(replay: EpisodeReplay, act: FactInterval) -> Slip | None:
    """Return the failed try that led to a forbidden act: a drop, or an unsteady hand; else None."""
    if act.role is FactRole.PLACING:
        return drop_before(replay, act)
    if act.role is FactRole.CARRY:
        return unsteady_visit(replay, act)
    return None


def _failure_by_rule(replay: EpisodeReplay, deviation: _Deviation, act: Fact) -> FailureName | None:
    """Return the failure that the violated rule names, but for presses; None if it names none.

    A press is judged by its moment where a task asks for one. It is a touch if the hand holds
    something or is not at the button: then its side pressed, or the arm.
    """
    roles = replay.roles_at(deviation.step)
    is_by_fingertips = FactRole.GRIP not in roles and FactRole.APPROACH in roles
    if act.traits.role is FactRole.PRESS and not is_by_fingertips:
        return "touched_button"
    if deviation.failure == "mistimed":
        return judge_moment(replay, deviation.step)
    return deviation.failure


def _deviations(replay: EpisodeReplay) -> Iterator[_Deviation]:
    """Yield each moment from which on a rule was sure to be violated, then that of the violation.

    The last one is yielded only if the judge found a violation.
    """
    yield from _lasting_deviations(replay)
    for rule in _last_stages(replay):
        yield from _wasted_occurrences(replay, rule)
    violation = replay.judge.violation
    if violation is not None:
        act = _latest_act(replay, violation, replay.last_step)
        yield _Deviation(replay.last_step, violation, act)


def _lasting_deviations(replay: EpisodeReplay) -> Iterator[_Deviation]:
    """Yield the moments from which on what a rule forbids holds for good, once for each rule.

    A third red cube falls into the bin where the goal has two: a cube never leaves the bin, so the
    rule of the last stage is already sure to be violated. Only rules of current and later stages
    count.
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
    """Yield the first occurrence of an act that is too many for a limit; at most one.

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
    """Return whether a fact completed a stage that expected it, while it held.

    The interval has the fact with its first step and the first step at which it no longer held.
    """
    for stage, step in replay.completions():
        is_expected = replay.stages[stage].expects == interval.fact
        # At the step at which it ends, the fact no longer holds.
        if is_expected and interval.start <= step and interval.lasts_until(step + 1):
            return True
    return False


def _last_stages(replay: EpisodeReplay) -> dict[Rule, int]:
    """Return the rules of all stages, each with the index of the last stage that forbids it."""
    last_stages = {}
    for index, stage in enumerate(replay.stages):
        for forbidden in stage.forbids:
            if isinstance(forbidden, Rule):
                last_stages[forbidden] = index
    return last_stages


def _lasts(condition: Condition) -> bool:
    """Return whether a condition, once an act has met it, can never be undone.

    A cube in the bin lasts, as do two cubes in the bin; a cube in the hand and a span of time do
    not.
    """
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
    """Return the latest of the acts that violate a rule, or a fact, up to a step.

    Acts whose fact still holds at the step come first. None if no act does it: it is only the time.
    """
    facts = facts_of(violation)
    acts = [act for act in replay.intervals if act.fact in facts and act.start <= step]
    if not acts:
        return None
    still_holding = [act for act in acts if act.lasts_until(step + 1)]
    return max(still_holding or acts, key=lambda act: act.start).fact


def _describe_deviation(replay: EpisodeReplay, deviation: _Deviation) -> str:
    """Return a deviation in words: *pressed the button too early; expected: pick up the cube*."""
    stage = replay.stage_at(deviation.step)
    return describe_violation(deviation.violation, stage, replay.episode.scene)


def refine_wrong_object(
    found: FailureAttribution,
    replay: EpisodeReplay,
    mirrored: MirroredObjects,
    deviation: _Deviation | None,
) -> FailureAttribution:
    """Return a ``mirrored_pick`` if the wrong object or place is the mirrored one.

    *The left cube* means the red one, and with left and right exchanged the blue one: taking the
    blue cube is a mirrored pick.

    Args:
        found: the failure so far; its step counts since the world began.
        replay: of the episode.
        mirrored: the mirror images of each object that the words mean.
        deviation: the first one, whose act may have a place; None without any.
    """
    if found.failure not in ("wrong_object", "wrong_place"):
        return found
    names: list[str | None] = [found.subject]
    if deviation is not None and deviation.act is not None:
        names.append(deviation.act.place)
    if _mirror_images(replay.stage_at(found.step), mirrored).isdisjoint(names):
        return found
    words = f"{found.sentence[:-1]}; the words mean it only with left and right exchanged"
    return FailureAttribution.of("mirrored_pick", found.subject, found.step, words)


def _mirror_images(stage: Stage, mirrored: MirroredObjects) -> set[str | None]:
    """Return the mirror images of the objects that the words mean and a stage expects.

    Of all that the words mean if the stage expects none of them.
    """
    expected: set[str | None] = set()
    for fact in facts_of(stage.expects):
        expected.update((fact.subject, fact.place))
    meant_and_expected = [name for name in mirrored if name in expected]
    images: set[str | None] = set()
    for name in meant_and_expected or mirrored:
        images.update(mirrored[name])
    return images
