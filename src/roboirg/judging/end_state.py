"""Conclude a failure from the end of an episode that violated no rule."""

from __future__ import annotations

from collections.abc import Iterator

from roboirg.core.conditions import Elapsed, Fact, Rule, facts_of
from roboirg.core.fact_traits import FactRole, raised_kind
from roboirg.core.failures import FailureName
from roboirg.judging.episode_replay import EpisodeReplay, FactInterval
from roboirg.judging.fact_history import FactHistory
from roboirg.judging.failure_attribution import FailureAttribution
from roboirg.judging.grounding_errors import classify_grounding_error
from roboirg.judging.judge import describe_act, describe_object
from roboirg.judging.release_errors import describe_missed_grasp, describe_release, expected_action

AT_REST = Fact("still", "robot")
REST_STEPS = 100
"""Control steps (five seconds) that the robot must rest at the end to count as stopped."""


def describe_end_state(replay: EpisodeReplay) -> FailureAttribution:
    """Return the failure that the end of an episode shows.

    | the end | is |
    | --- | --- |
    | an act stands that is not expected | as `classify_grounding_error` says |
    | the expected object is in the hand, and nothing above or below fits | ``out_of_time`` |
    | an object that was to be carried is not in the hand | ``dropped`` or ``misplaced`` |
    | an object that was to be picked was reached, or held, and is not in the hand | \
``missed_grasp`` |
    | the robot stopped where a shorter task would have ended | ``wrong_count`` |
    | no stage was completed, and nothing expected was reached | ``nothing_reached`` |
    | otherwise | ``out_of_time`` |
    """
    wanted = replay.unmet()
    unexpected, in_hand = _unexpected_act(replay, wanted), _in_hand(replay, wanted)
    if in_hand is not None:
        return unexpected or _stopped_short(replay) or in_hand
    return (
        unexpected
        or _released(replay, wanted)
        or describe_missed_grasp(replay, wanted)
        or _stopped_short(replay)
        or _nothing_done(replay, wanted)
    )


def _unexpected_act(replay: EpisodeReplay, wanted: tuple[Fact, ...]) -> FailureAttribution | None:
    """Return the last act that stands and is not expected."""
    for interval in reversed(list(_standing_acts(replay))):
        fact = interval.fact
        if fact.subject in {other.subject for other in wanted}:
            failure = _future_violation(replay, fact.subject) if fact.traits.grips else None
        else:
            failure = _future_violation(replay, fact.subject) or _classify(replay, fact, wanted)
        if failure is not None:
            words = f"{describe_act(fact, replay.episode.scene)}; {expected_action(replay)}"
            return FailureAttribution.of(failure, fact.subject, interval.start, words)
    return None


def _standing_acts(replay: EpisodeReplay) -> Iterator[FactInterval]:
    """Yield the acts that have not been undone.

    They are what is in the hand, and what was done in the current stage: looking under a container
    that a later stage expects, a press where the stage expects another button, and placing an
    object that was picked up.
    """
    since, roles = replay.expected_since, FactRole
    ahead = replay.stages[replay.expected_stage + 1 :]
    later = {fact for stage in ahead for fact in facts_of(stage.expects)}
    current = facts_of(replay.stages[replay.expected_stage].expects)
    expects_press = any(fact.traits.role is roles.PRESS for fact in current)
    # An object that was not picked up was there before and has only been touched.
    raised = {one.fact.subject for one in replay.started(roles.RAISE, after=since)}
    acts = (roles.GRIP, roles.RAISE, roles.PLACING, roles.PRESS)
    for interval in replay.started(*acts, after=replay.policy_start_step):
        fact, traits = interval.fact, interval.fact.traits
        stands = {
            roles.RAISE: not traits.undone_by_release and fact in later,
            roles.PRESS: expects_press,
            roles.PLACING: interval.end is None and not traits.lasts and fact.subject in raised,
        }
        in_hand = traits.grips and interval.end is None
        if in_hand or (interval.start > since and stands.get(traits.role, False)):
            yield interval


def _classify(replay: EpisodeReplay, fact: Fact, wanted: tuple[Fact, ...]) -> FailureName | None:
    """Classify an act; taking hold of an object counts as lifting it."""
    if fact in wanted:
        return None
    if fact.traits.role is FactRole.GRIP:
        kind = raised_kind(replay.episode.scene[fact.subject].kind)
        fact = fact if kind is None else Fact(kind, fact.subject)
    return classify_grounding_error(fact, replay.stages, replay.expected_stage)


def _future_violation(replay: EpisodeReplay, name: str) -> FailureName | None:
    """Return the failure of the rule that an object would violate for good at its places.

    The object is thought to be where the coming stages want it; None if no stage does, or if it
    may be there.
    """
    ahead = replay.stages[replay.expected_stage :]
    expected = {fact for stage in ahead for fact in facts_of(stage.expects)}
    placed = {fact for fact in expected if fact.subject == name and fact.traits.lasts}
    if not placed:
        return None
    history = FactHistory()
    history.update(0, replay.facts[-1] | placed)
    rules = (one for stage in ahead for one in stage.forbids if isinstance(one, Rule))
    return next((rule.failure for rule in rules if _is_violated(rule, placed, history)), None)


def _is_violated(rule: Rule, placed: set[Fact], history: FactHistory) -> bool:
    """Return whether placed objects violate a rule.

    A rule whose condition needs none of its facts is violated by too few of them, which objects at
    their places cannot do.
    """
    least = getattr(rule.condition, "least", 1)  # only counts and times have one
    return bool(least and placed & set(facts_of(rule)) and history.holds(rule.condition))


def _in_hand(replay: EpisodeReplay, wanted: tuple[Fact, ...]) -> FailureAttribution | None:
    """Return ``out_of_time`` if the expected object is in the hand."""
    names = {fact.subject for fact in wanted}
    gripped = (fact.subject for fact in replay.facts[-1] if fact.traits.grips)
    held = sorted(name for name in gripped if name in names)
    if not held:
        return None
    item = describe_object(held[0], replay.episode.scene)
    words = f"ran out of time with {item} in the hand; {expected_action(replay)}"
    return FailureAttribution.of("out_of_time", held[0], replay.last_step, words)


def _released(replay: EpisodeReplay, wanted: tuple[Fact, ...]) -> FailureAttribution | None:
    """Return the failure if an object that was to be carried is not in the hand."""
    if any(fact.traits.role is FactRole.RAISE for fact in wanted):
        return None
    names = {fact.subject for fact in wanted}
    lifts = replay.started(FactRole.RAISE, after=replay.policy_start_step)
    grips = [interval for interval in lifts if interval.fact.subject in names]
    if not grips:
        return None
    last = max(grips, key=lambda interval: interval.start)
    rests = replay.started(FactRole.RELEASE, after=last.start)
    own = (rest.start for rest in rests if rest.fact.subject == last.fact.subject)
    step = next(own, last.end)
    return describe_release(replay, last, replay.last_step if step is None else step)


def _stopped_short(replay: EpisodeReplay) -> FailureAttribution | None:
    """Return ``wrong_count`` if the robot stopped where a shorter task would have ended.

    A shorter task would have ended with an act like the last stage's, so the stage before must have
    asked for one; letting go does not count as an act. A task that ends by leaving all alone for a
    time could have ended after any stage.
    """
    acts_before = [
        {fact.kind for fact in facts_of(stage.expects)}
        for stage in replay.stages[: replay.expected_stage]
        if not all(fact.traits.role is FactRole.RELEASE for fact in facts_of(stage.expects))
    ]
    last = replay.stages[-1].expects
    if not acts_before:
        return None
    if isinstance(last, Elapsed):
        since = _untouched_since(replay, last.least)
    elif acts_before[-1] == {fact.kind for fact in facts_of(last)}:
        since = _at_rest_since(replay)
    else:
        return None
    if since is None:
        return None
    return FailureAttribution.of(
        "wrong_count", None, since, f"came to rest; {expected_action(replay)}"
    )


def _untouched_since(replay: EpisodeReplay, steps: int) -> int | None:
    """Return when the hand last touched an object, if it left all alone for some steps."""
    touches = (one for one in replay.intervals if one.fact.traits.touches)
    ends = (replay.last_step if one.end is None else one.end for one in touches)
    touched = max(ends, default=0)
    return touched if replay.last_step - touched >= steps else None


def _at_rest_since(replay: EpisodeReplay) -> int | None:
    """Return since when the robot rests, if that is long enough to count as stopped."""
    rests = (one for one in replay.intervals if one.fact == AT_REST and one.end is None)
    long_rests = (one.start for one in rests if replay.last_step - one.start >= REST_STEPS)
    return next(long_rests, None)


def _nothing_done(replay: EpisodeReplay, wanted: tuple[Fact, ...]) -> FailureAttribution:
    """Return ``nothing_reached`` or ``out_of_time``.

    An object or place is reached when the hand is above it, an APPROACH fact with it as the place.
    """
    names = {fact.subject for fact in wanted} | {fact.place for fact in wanted}
    start = replay.policy_start_step
    tried = any(
        one.fact.place in names and (one.end is None or one.end > start)
        for one in replay.intervals
        if one.fact.traits.role is FactRole.APPROACH
    )
    if replay.expected_stage == 0 and wanted and not tried:
        words = f"reached none of the objects it needs; {expected_action(replay)}"
        return FailureAttribution.of("no_attempt", None, replay.last_step, words)
    words = f"ran out of time; {expected_action(replay)}"
    return FailureAttribution.of("out_of_time", None, replay.last_step, words)
