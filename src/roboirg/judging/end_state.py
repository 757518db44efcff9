"""Conclude a failure from what was tried, and from the end of an episode that violated no rule."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from roboirg.core.conditions import Elapsed, Fact, facts_of
from roboirg.core.fact_traits import FactRole, raised_kind
from roboirg.core.failures import FailureName
from roboirg.core.motions import Shuttle
from roboirg.judging.episode_replay import EpisodeReplay, FactInterval
from roboirg.judging.failure_attribution import FailureAttribution
from roboirg.judging.grounding_errors import classify_grounding_error
from roboirg.judging.judge import describe_act, describe_expected, describe_object
from roboirg.judging.meant_objects import meant_objects
from roboirg.judging.slips import (
    SETTLED_STEPS,
    Slip,
    drop_before,
    find_slips,
    is_noticed,
)

STOPPED_STEPS = 150
"""Control steps for which the hand must linger at the end, seven and a half seconds and the three
after which it lingers, to count as stopped. A hand five times slower than the oracle's does not."""

_WORDS = {
    "missed_grasp": "did not get hold of {}",
    "missed_press": "came down next to {} without pressing it",
    "dropped": "dropped {}",
    "misplaced": "brought {} next to its place",
    "wrong_place": "put {} next to another place",
    "wrong_object": "tried to handle {}",
    "wrong_order": "tried to handle {}",
    "ambiguous_act": "closed its fingers between {} and something else",
    "wrong_time": "came down next to {} at another moment",
    "out_of_time": "ran out of time",
    "stopped": "stopped",
    "no_attempt": "tried nothing of what it needs",
}
"""What was tried, or how it ended, in the past tense, by the failure that it is."""


def describe_end_state(replay: EpisodeReplay) -> FailureAttribution:
    """Return the failure that the end of an episode shows; the first that fits.

    | the end | is |
    | --- | --- |
    | an act stands that is not expected | as `classify_grounding_error` says, or the slips that \
explain it |
    | the current stage was tried, and its object is not in the hand | as `judge_tries` says |
    | the hand stopped where a shorter task would have ended | ``wrong_count``, or the slips that \
explain it |
    | the hand had stopped, or did nothing from the beginning | ``stopped``, ``no_attempt`` |
    | the hand still moved, and had been at something that is expected | ``out_of_time`` |
    | it moved elsewhere | ``no_attempt`` |
    """
    wanted, slips = replay.unmet(), find_slips(replay)
    unexpected = _unexpected_act(replay, wanted)
    if unexpected is not None and drop_before(slips, unexpected[0]) is None:
        act, failure = unexpected
        found = explain_early_act(replay, slips, act.fact)
        return found or _describe_act(replay, failure, act)
    in_hand = {one.subject for one in wanted} & {
        fact.subject for fact in replay.facts[-1] if fact.traits.grips
    }
    short = _stopped_short(replay) or _done_too_early(replay)
    if short is not None:
        left = range(replay.expected_stage, len(replay.stages))
        short = explain_missing(replay, slips, left) or short
    tried = None if in_hand else judge_tries(replay, slips)
    return tried or short or _at_rest(replay)


def explain_early_act(
    replay: EpisodeReplay, slips: Sequence[Slip], act: Fact
) -> FailureAttribution | None:
    """Return the slips or tries before an act that a later stage expects, if they explain it."""
    current, stages = replay.expected_stage, replay.stages
    later = range(current + 1, len(stages))
    index = next((one for one in later if act in facts_of(stages[one].expects)), None)
    if index is None:
        return None
    if explained := explain_missing(replay, slips, range(current, index)):
        return explained
    tried = judge_tries(replay, slips)
    return tried if tried is not None and tried.kind == "grounding" else None


def explain_missing(
    replay: EpisodeReplay, slips: Sequence[Slip], skipped: range
) -> FailureAttribution | None:
    """Return the first of the unnoticed slips if they account for all acts that are missing.

    A slip accounts for one object that was to be handled, from its pick on; places that were passed
    are counted one by one. `skipped` has the indices of the stages that are missing.
    """
    early = {one.fact for one in replay.started(FactRole.RAISE, after=replay.acted_since)}
    acts = [set(facts_of(replay.stages[one].expects)) for one in skipped]
    roles = [{fact.traits.role for fact in own} for own in acts if not own & early]
    raises = [index for index, own in enumerate(roles) if FactRole.RAISE in own]
    head = [own for own in roles[: raises[0] if raises else None] if own - {FactRole.RELEASE}]
    own = [
        one
        for one in slips
        if one.subjects <= _meant(replay, skipped) and not is_noticed(replay, one, slips)
    ]
    visits = sum(FactRole.CARRY in roles for roles in head)
    passed = sum(one.failure == "misplaced" for one in own) if visits else 0
    if not own or len(own) - passed + bool(visits and passed >= visits) < len(raises) + bool(head):
        return None
    return describe_slip(replay, own[0])


def judge_tries(replay: EpisodeReplay, slips: Sequence[Slip]) -> FailureAttribution | None:
    """Return what the failed tries in the current stage show; None without any.

    | mostly tried was | is |
    | --- | --- |
    | what the stage expects | the last loss of it, or the last failed try |
    | what a later stage expects | ``wrong_order`` |
    | something else | ``wrong_object`` |
    | what the stage expects or another thing, which is not clear | ``ambiguous_act`` |
    """
    right, ahead = _right_now(replay), range(replay.expected_stage, len(replay.stages))
    tries = [one for one in slips if one.step >= replay.acted_since]
    clear = [one for one in tries if one.subjects <= right]
    off = [one for one in tries if not one.subjects & right]
    if clear and len(clear) >= len(off):
        lost = [one for one in clear if one.failure not in ("missed_grasp", "missed_press")]
        return describe_slip(replay, (lost or clear)[-1])
    if off:
        is_later = off[-1].subjects & _meant(replay, ahead)
        failure: FailureName = "wrong_order" if is_later else "wrong_object"
        return describe_slip(replay, off[-1], failure)
    return describe_slip(replay, tries[-1], "ambiguous_act") if tries else None


def _right_now(replay: EpisodeReplay) -> frozenset[str]:
    """Return the objects that the stage means that is current at the end."""
    current = max(replay.expected_stage, 0)
    return meant_objects(replay.stages, current, replay.episode.scene, replay.facts[-1])


def _meant(replay: EpisodeReplay, indices: range) -> set[str]:
    """Return the objects that some stages mean."""
    return {
        name for one in indices for name in meant_objects(replay.stages, one, replay.episode.scene)
    }


def describe_slip(
    replay: EpisodeReplay, slip: Slip, failure: FailureName | None = None
) -> FailureAttribution:
    """Return a slip as a failure, by default its own; a press has the failure of its moment."""
    name, moment = failure or slip.failure, judge_moment(replay, slip.step)
    if name == "missed_press" and moment is not None and moment != "mistimed":
        name = moment
    subject, expected = min(slip.subjects), describe_expected(replay.stage_at(slip.step))
    words = _WORDS[name].format(describe_object(subject, replay.episode.scene))
    return FailureAttribution.of(name, subject, slip.step, f"{words}; {expected}")


def judge_moment(replay: EpisodeReplay, step: int) -> FailureName | None:
    """Return what pressing at a step is if it must be at a moment and is not; else None.

    The moment is that of the oracle's press, the middle of a pass of the object that moves.
    """
    press, runs = replay.stages[-1].primitive, replay.episode.scene.motions_of(Shuttle)
    if not runs or press.kind != "press_below":
        return None
    (run,) = runs
    if abs(step - press.steps) <= run.interval / 2:
        return "mistimed"
    coming = replay.facts[step : step + SETTLED_STEPS // 4]
    is_near = any(fact.subject == run.subject and fact.place for now in coming for fact in now)
    return "wrong_time" if is_near else "ambiguous_act"


def _describe_act(
    replay: EpisodeReplay, failure: FailureName, act: FactInterval
) -> FailureAttribution:
    """Return an act as a failure, in words."""
    words = describe_act(act.fact, replay.episode.scene)
    return _describe(replay, failure, act.fact.subject, act.start, words)


def _describe(
    replay: EpisodeReplay, failure: FailureName, subject: str | None, step: int, words: str
) -> FailureAttribution:
    """Return a failure in words, and what is expected at the end."""
    expected = describe_expected(replay.stages[max(replay.expected_stage, 0)])
    return FailureAttribution.of(failure, subject, step, f"{words}; {expected}")


def _unexpected_act(
    replay: EpisodeReplay, wanted: tuple[Fact, ...]
) -> tuple[FactInterval, FailureName] | None:
    """Return the last act that stands and is not expected, and what it is."""
    for interval in reversed(list(_standing_acts(replay))):
        fact = interval.fact
        if fact.subject not in {other.subject for other in wanted}:
            failure: FailureName | None = _classify(replay, fact)
        elif fact.traits.grips and fact.subject not in _right_now(replay):
            failure = "wrong_object"
        else:
            misplaced = fact.traits.role is FactRole.PLACING and fact not in wanted
            failure = "wrong_place" if misplaced else None
        if failure is not None:
            return interval, failure
    return None


def _standing_acts(replay: EpisodeReplay) -> Iterator[FactInterval]:
    """Yield the acts that have not been undone.

    They are what is in the hand, and what was done in the current stage: looking under a container
    that a later stage expects, a press where the stage expects another button, and placing an
    object that was picked up.
    """
    since, roles = replay.acted_since, FactRole
    ahead = replay.stages[replay.expected_stage + 1 :]
    later = {fact for stage in ahead for fact in facts_of(stage.expects)}
    expected = facts_of(replay.stages[replay.expected_stage].expects)
    # An object that was not picked up was there before and has only been touched.
    raised = {one.fact.subject for one in replay.started(roles.RAISE)}
    acts = (roles.GRIP, roles.RAISE, roles.PLACING, roles.PRESS)
    for interval in replay.started(*acts):
        fact, traits = interval.fact, interval.fact.traits
        stands = {
            roles.RAISE: not traits.undone_by_release and fact in later,
            roles.PRESS: fact in later or any(one.traits.role is roles.PRESS for one in expected),
            roles.PLACING: interval.end is None and not traits.lasts and fact.subject in raised,
        }
        in_hand = traits.grips and interval.end is None
        if in_hand or (interval.start > since and stands.get(traits.role, False)):
            yield interval


def _classify(replay: EpisodeReplay, fact: Fact) -> FailureName:
    """Classify an act; taking hold of an object counts as lifting it."""
    if fact.traits.role is FactRole.GRIP:
        kind = raised_kind(replay.episode.scene[fact.subject].kind)
        fact = fact if kind is None else Fact(kind, fact.subject)
    return classify_grounding_error(fact, replay.stages, replay.expected_stage)


def _stopped_short(replay: EpisodeReplay) -> FailureAttribution | None:
    """Return ``wrong_count`` if the robot stopped where a shorter task would have ended.

    A shorter task would have ended with an act like the last stage's, so the stage before must have
    asked for one; letting go does not count as an act. A task that ends by leaving all alone for a
    time could have ended after any stage.
    """
    roles = [{fact.traits.role for fact in facts_of(stage.expects)} for stage in replay.stages]
    before = [own for own in roles[: replay.expected_stage] if own != {FactRole.RELEASE}]
    since, last = _lingers_since(replay), replay.stages[-1].expects
    if since is None or not before or not (isinstance(last, Elapsed) or before[-1] == roles[-1]):
        return None
    return _describe(replay, "wrong_count", None, since, "came to rest")


def _done_too_early(replay: EpisodeReplay) -> FailureAttribution | None:
    """Return ``wrong_order`` if what the stage expects was done before it was expected."""
    stages, current, since = replay.stages, replay.expected_stage, replay.acted_since
    before = {fact for stage in stages[:current] for fact in facts_of(stage.expects)}
    wanted = set(facts_of(stages[current].expects)) - before
    acts = replay.started(FactRole.RAISE, FactRole.PRESS)
    act = next((one for one in acts if one.fact in wanted and one.start < since), None)
    return None if act is None else _describe_act(replay, "wrong_order", act)


def _lingers_since(replay: EpisodeReplay) -> int | None:
    """Return since when the hand lingers at the end, if that is long enough to have stopped."""
    rests = list(replay.tried("lingering"))
    if not rests or rests[-1].end is not None:
        return None
    # Who goes slowly, or pauses, has lingered as long before. A deadline leaves no time for that.
    pauses = [1.5 * (one.end - one.start) for one in rests if one.end is not None]
    least = 0 if replay.judge.violation else max([STOPPED_STEPS, *pauses])
    return rests[-1].start if replay.last_step - rests[-1].start >= least else None


def _at_rest(replay: EpisodeReplay) -> FailureAttribution:
    """Return ``stopped``, ``no_attempt`` or ``out_of_time``, as the table says."""
    names = _meant(replay, range(len(replay.stages)))
    went = [*replay.tried("above"), *replay.started(FactRole.APPROACH)]
    acts = replay.started(FactRole.GRIP, FactRole.RAISE, FactRole.PRESS)
    has_begun = replay.expected_stage > 0 or any(one.fact.place in names for one in went)
    since = _lingers_since(replay)
    failure: FailureName = "out_of_time" if since is None else "stopped"
    if not has_begun and not any(acts):
        failure = "no_attempt"
    step = replay.last_step if since is None else since
    return _describe(replay, failure, None, step, _WORDS[failure])
