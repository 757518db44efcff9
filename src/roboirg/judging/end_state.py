"""Conclude a failure from what was tried, and from the end of an episode that violated no rule."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import NamedTuple

from roboirg.core.conditions import Elapsed, Fact, facts_of
from roboirg.core.episode import Stage
from roboirg.core.fact_traits import FactRole, raised_kind
from roboirg.core.failures import FailureName
from roboirg.core.motions import Shuttle
from roboirg.judging.episode_replay import EpisodeReplay, FactInterval
from roboirg.judging.failure_attribution import FailureAttribution
from roboirg.judging.grounding_errors import classify_grounding_error, next_stage_with
from roboirg.judging.judge import describe_act, describe_expected, describe_object
from roboirg.judging.meant_objects import meant_objects
from roboirg.judging.slips import (
    MISSES,
    Slip,
    drop_before,
    find_slips,
    is_noticed,
)

STOPPED_STEPS = 150
"""Control steps for which the hand must linger at the end, seven and a half seconds and the three
after which it lingers, to count as stopped. A hand five times slower than the oracle's does not."""

_OTHER_VISIT = 2 / 3
"""Passes off the right moment from which on a press was meant for another visit: the nearest of
these is then at most half as far off as the right one."""
_APPROACH_STEPS = 60
"""Control steps for which the hand is above an object to which it went, and not past it."""
_PAUSE_FACTOR = 1.5
"""How many times as long as any pause before it a rest must be to count as stopping."""

_FAILURE_WORDS: Mapping[FailureName, str] = {
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
    | the hand stays above wrong objects only, where one is to be picked up | ``wrong_object`` |
    | the hand had stopped, or did nothing from the beginning | ``stopped``, ``no_attempt`` |
    | the hand still moved, and had been at something that is expected | ``out_of_time`` |
    | it moved elsewhere | ``no_attempt`` |
    """
    unmet = replay.unmet()
    unexpected = _judge_standing_act(replay, unmet)
    if unexpected is not None:
        return unexpected

    held = {fact.subject for fact in replay.facts[-1] if fact.traits.grips}
    # With the expected object in the hand, the tries to take it have succeeded: none decides.
    if held.isdisjoint(fact.subject for fact in unmet):
        failed_try = judge_tries(replay)
        if failed_try is not None:
            return failed_try

    misunderstanding = _stopped_short(replay) or _done_too_early(replay)
    if misunderstanding is None:
        return _at_rest(replay)
    # Who missed a grasp and went on without noticing has misunderstood nothing.
    return explain_missing(replay, replay.stages_left) or misunderstanding


def explain_early_act(replay: EpisodeReplay, act: Fact) -> FailureAttribution | None:
    """Return the failed tries that explain why an act was done before its time; else None.

    The button is pressed although two of three cubes are in the bin: a grasp that was missed
    unnoticed explains it (the hands failed), and so do tries at a wrong cube (the words were
    misunderstood). None also if no later stage expects the act.
    """
    current_stage = replay.expected_stage
    stage_of_act = next_stage_with(act, replay.stages, current_stage)
    if stage_of_act is None:
        return None
    missed_unnoticed = explain_missing(replay, range(current_stage, stage_of_act))
    if missed_unnoticed is not None:
        return missed_unnoticed
    # A failed try at the right object is no reason to go on with a later act.
    failed_try = judge_tries(replay)
    return failed_try if failed_try is not None and failed_try.kind == "grounding" else None


def explain_missing(replay: EpisodeReplay, skipped: range) -> FailureAttribution | None:
    """Return the first of the unnoticed failed tries if these explain all acts that are missing.

    Two cubes are missing in the bin and two grasps were missed unnoticed: the first of them is the
    failure. With one missed grasp, the other cube was left out on purpose: None.

    A try explains one object that was to be handled, from its pick on. Where the object in the hand
    is to be carried over several places, a pass next to one of them explains that place only.
    `skipped` has the indices of the stages whose acts are missing.
    """
    meant = _objects_meant_by_any(replay, skipped)
    unnoticed = []
    for slip in find_slips(replay):
        if slip.subjects & meant and not is_noticed(replay, slip):
            unnoticed.append(slip)
    if not unnoticed:
        return None

    missing = _missing_acts(replay, skipped)
    explained_objects = len(unnoticed)
    if missing.visits:
        passes = sum(slip.failure == "misplaced" for slip in unnoticed)
        explained_objects -= passes
        if passes >= missing.visits:
            explained_objects += 1  # the object that was carried past all places
    if explained_objects < missing.objects:
        return None
    if any(slip.subjects - meant for slip in unnoticed):
        return describe_slip(replay, unnoticed[0], "ambiguous_act")
    return describe_slip(replay, unnoticed[0])


class _Missing(NamedTuple):
    """What was to be done and was not.

    Attributes:
        objects: how many objects were to be handled: one for each pick, and the one in the hand.
        visits: over how many places the one in the hand was to be carried.
    """

    objects: int
    visits: int


def _missing_acts(replay: EpisodeReplay, skipped: range) -> _Missing:
    """Return how many objects and places the skipped stages were still to handle.

    Of *pick the red cube, put it in, pick the blue one, put it in*, two objects are missing; of
    *put it in, pick the blue one, put it in*, two as well, the first of them in the hand. Stages of
    an object that was picked up before do not count.
    """
    last_act_step = replay.acted_since
    picked_up = {interval.fact for interval in replay.started(FactRole.RAISE, after=last_act_step)}
    picks = 0
    visits = 0
    has_one_in_hand = False
    for index in skipped:
        stage = replay.stages[index]
        if not picked_up.isdisjoint(facts_of(stage.expects)):
            continue
        roles = _expected_roles(stage)
        if FactRole.RAISE in roles:
            picks += 1
        elif picks == 0 and roles - {FactRole.RELEASE}:
            # Before any pick, a stage is about what the hand already holds.
            has_one_in_hand = True
            visits += FactRole.CARRY in roles
    return _Missing(picks + has_one_in_hand, visits)


def _expected_roles(stage: Stage) -> set[FactRole]:
    """Return the roles of the facts that a stage expects; none if it only waits."""
    return {fact.traits.role for fact in facts_of(stage.expects)}


def judge_tries(replay: EpisodeReplay) -> FailureAttribution | None:
    """Return what the failed tries in the current stage show; None without any.

    | mostly tried was | is |
    | --- | --- |
    | what the stage expects | the last loss of it, or the last failed try |
    | what a later stage expects | ``wrong_order`` |
    | something else | ``wrong_object`` |
    | what the stage expects or another thing, which is not clear | ``ambiguous_act`` |
    """
    stage_began = replay.acted_since
    tries = [slip for slip in find_slips(replay) if slip.step >= stage_began]
    if not tries:
        return None
    right_objects = _objects_meant_at_end(replay)
    # What can have been about a right object or about another one is in neither list.
    at_right = [slip for slip in tries if slip.subjects <= right_objects]
    at_wrong = [slip for slip in tries if slip.subjects.isdisjoint(right_objects)]

    if not at_right and not at_wrong:
        return describe_slip(replay, tries[-1], "ambiguous_act")
    if len(at_right) >= len(at_wrong):
        losses = [slip for slip in at_right if slip.failure not in MISSES]
        decisive = losses or at_right
        return describe_slip(replay, decisive[-1])

    last_try = at_wrong[-1]
    due_later = _objects_meant_by_any(replay, replay.stages_left)
    if last_try.subjects.isdisjoint(due_later):
        return describe_slip(replay, last_try, "wrong_object")
    return describe_slip(replay, last_try, "wrong_order")


def _objects_meant_at_end(replay: EpisodeReplay) -> frozenset[str]:
    """Return the names of the objects that the stage means that is current at the end."""
    current = replay.expected_stage
    return meant_objects(replay.stages, current, replay.episode.scene, replay.facts[-1])


def _objects_meant_by_any(replay: EpisodeReplay, indices: range) -> set[str]:
    """Return the names of the objects that any of some stages means."""
    names: set[str] = set()
    for index in indices:
        names |= meant_objects(replay.stages, index, replay.episode.scene)
    return names


def describe_slip(
    replay: EpisodeReplay, slip: Slip, failure: FailureName | None = None
) -> FailureAttribution:
    """Return a failed try as the failure of an episode, with a sentence about it.

    A drop of the red cube -> ``dropped``, *Dropped the red cube; expected: put it into the bin.*
    Without a `failure` it is that of the try. A press that missed the button at a wrong moment is
    the failure of the moment.
    """
    if failure is None:
        failure = slip.failure
    if failure == "missed_press":
        moment = judge_moment(replay, slip.step)
        # At about the right moment, it is the button that was missed.
        if moment not in (None, "mistimed"):
            failure = moment

    subject = min(slip.subjects)
    words = _FAILURE_WORDS[failure].format(describe_object(subject, replay.episode.scene))
    expected = describe_expected(replay.stage_at(slip.step))
    return FailureAttribution.of(failure, subject, slip.step, f"{words}; {expected}")


def judge_moment(replay: EpisodeReplay, step: int) -> FailureName | None:
    """Return which failure a press is in a task that asks for a moment; None in other tasks.

    An object passes its place several times, and the press is to stop it there. The right step is
    that of the oracle's press, the middle of a pass. Within half a pass of it, the press is
    ``mistimed``; from `_OTHER_VISIT` on it was meant for another pass, ``wrong_time``; in between
    it is an ``ambiguous_act``. Steps count since the world began.
    """
    press = replay.stages[-1].primitive
    moving_objects = replay.episode.scene.motions_of(Shuttle)
    if not moving_objects or press.kind != "press_below":
        return None
    (moving_object,) = moving_objects
    steps_off = abs(step - press.steps)
    # The pass is judged at the end of its last step.
    if steps_off <= moving_object.interval / 2 + 1:
        return "mistimed"
    is_other_visit = steps_off >= moving_object.interval * _OTHER_VISIT
    return "wrong_time" if is_other_visit else "ambiguous_act"


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
    expected = describe_expected(replay.stages[replay.expected_stage])
    return FailureAttribution.of(failure, subject, step, f"{words}; {expected}")


def _judge_standing_act(replay: EpisodeReplay, unmet: Sequence[Fact]) -> FailureAttribution | None:
    """Return the failure of the last act that still stands and is not expected; None without any.

    None also if an object fell where it lies and was not put there: then the drop, a slip, decides.
    `unmet` has the facts that the current stage expects and that do not hold yet.
    """
    acts = list(_standing_acts(replay))
    for act in reversed(acts):
        failure = _failure_of_act(replay, act.fact, unmet)
        if failure is None:
            continue
        if drop_before(replay, act) is not None:
            return None
        return explain_early_act(replay, act.fact) or _describe_act(replay, failure, act)
    return None


def _failure_of_act(replay: EpisodeReplay, fact: Fact, unmet: Sequence[Fact]) -> FailureName | None:
    """Return the failure that an act is; None if it may lead to what the current stage expects.

    With *put the red cube on the target* unmet: a red cube in the hand -> None, on the wrong target
    -> ``wrong_place``; a green cube in the hand -> as `classify_grounding_error` says. `unmet` has
    the facts that the stage expects and that do not hold yet.
    """
    if all(fact.subject != expected.subject for expected in unmet):
        return _classify(replay, fact)
    # A stage may expect any cube, of which only some are meant.
    if fact.traits.grips and fact.subject not in _objects_meant_at_end(replay):
        return "wrong_object"
    if fact.traits.role is FactRole.PLACING and fact not in unmet:
        return "wrong_place"
    return None


def _standing_acts(replay: EpisodeReplay) -> Iterator[FactInterval]:
    """Yield what the policy did and did not undo, as intervals of the facts that it made.

    That is what is in the hand, and what was done in the current stage: looking under a container
    that a later stage expects, a press where the stage expects another button, and placing an
    object that was picked up.
    """
    roles = (FactRole.GRIP, FactRole.RAISE, FactRole.PLACING, FactRole.PRESS)
    stage_began = replay.acted_since
    for act in replay.started(*roles):
        is_in_hand = act.fact.traits.grips and act.end is None
        if is_in_hand or (act.start > stage_began and _is_not_undone(replay, act)):
            yield act


def _is_not_undone(replay: EpisodeReplay, act: FactInterval) -> bool:
    """Return whether an act of the current stage has not been undone.

    A lift counts if a later stage expects it and letting go does not undo it; a press, if a later
    stage expects it, or the current one any press; a placed object, if it still lies there and was
    picked up before.
    """
    current_stage = replay.expected_stage
    is_due_later = act.fact in _expected_facts(replay.stages[current_stage + 1 :])
    match act.role:
        case FactRole.RAISE:
            return is_due_later and not act.fact.traits.undone_by_release
        case FactRole.PRESS:
            return is_due_later or FactRole.PRESS in _expected_roles(replay.stages[current_stage])
        case FactRole.PLACING:
            # An object that was not picked up was there before and has only been touched.
            raised = {raised.subject for raised in replay.started(FactRole.RAISE)}
            return act.end is None and not act.fact.traits.lasts and act.subject in raised
        case _:
            return False


def _expected_facts(stages: Sequence[Stage]) -> set[Fact]:
    """Return all facts that any of some stages expects."""
    facts: set[Fact] = set()
    for stage in stages:
        facts.update(facts_of(stage.expects))
    return facts


def _classify(replay: EpisodeReplay, fact: Fact) -> FailureName:
    """Classify an act; taking hold of an object counts as lifting it."""
    if fact.traits.role is FactRole.GRIP:
        kind = raised_kind(replay.episode.scene[fact.subject].kind)
        if kind is not None:
            fact = Fact(kind, fact.subject)
    return classify_grounding_error(fact, replay.stages, replay.expected_stage)


def _stopped_short(replay: EpisodeReplay) -> FailureAttribution | None:
    """Return ``wrong_count`` if the robot stopped where a shorter task would have ended; else None.

    A task of two lifted containers ends with a lift; who stops after the first lift has counted
    wrong. A task that ends with a press has no such end before the press. So the last completed
    act, letting go not counted, must be like that of the last stage. A task that ends by leaving
    all alone for a time could have ended after any stage.
    """
    stopped_at = _stopped_since(replay)
    completed_roles = [_expected_roles(stage) for stage in replay.stages[: replay.expected_stage]]
    act_roles = [roles for roles in completed_roles if roles != {FactRole.RELEASE}]
    if stopped_at is None or not act_roles:
        return None
    last_stage = replay.stages[-1]
    ends_alone = isinstance(last_stage.expects, Elapsed)
    if ends_alone or act_roles[-1] == _expected_roles(last_stage):
        return _describe(replay, "wrong_count", None, stopped_at, "came to rest")
    return None


def _done_too_early(replay: EpisodeReplay) -> FailureAttribution | None:
    """Return ``wrong_order`` if the robot did what is expected now before its time; else None.

    Acts that an earlier stage expected, too, were done for that stage.
    """
    current_stage = replay.expected_stage
    expected = facts_of(replay.stages[current_stage].expects)
    first_due_now = set(expected) - _expected_facts(replay.stages[:current_stage])
    stage_began = replay.acted_since
    for act in replay.started(FactRole.RAISE, FactRole.PRESS):
        if act.fact in first_due_now and act.start < stage_began:
            return _describe_act(replay, "wrong_order", act)
    return None


def _stopped_since(replay: EpisodeReplay) -> int | None:
    """Return the step since which the hand rests for good; None if it may only have paused.

    The rest must take 150 steps, and one and a half times as long as any pause before: after a
    pause of 200 steps, a rest of 300. Steps count since the world began.
    """
    rests = list(replay.tried("lingering"))
    if not rests or rests[-1].end is not None:
        return None

    longest_pause = max((replay.end_of(rest) - rest.start for rest in rests[:-1]), default=0)
    min_rest_steps = max(STOPPED_STEPS, _PAUSE_FACTOR * longest_pause)
    if replay.judge.violation is not None:
        min_rest_steps = 0  # a deadline ended the episode, which leaves no time for a long rest
        if Fact("still", "robot") not in replay.facts[-1]:
            return None
    start = rests[-1].start
    return start if replay.last_step - start >= min_rest_steps else None


def _at_rest(replay: EpisodeReplay) -> FailureAttribution:
    """Return the failure of an episode in which nothing wrong was done, by how it ended.

    The hand did nothing of what the task needs, ``no_attempt``; it stopped, ``stopped``; or it was
    still moving, ``out_of_time``.
    """
    approach = _approach_to_wrong(replay)
    if approach is not None:
        return describe_slip(replay, approach, "wrong_object")
    stopped_at = _stopped_since(replay)
    step = replay.last_step
    failure: FailureName = "out_of_time"
    if stopped_at is not None:
        step = stopped_at
        failure = "stopped"
    if not _has_begun(replay):
        failure = "no_attempt"
    return _describe(replay, failure, None, step, _FAILURE_WORDS[failure])


def _approach_to_wrong(replay: EpisodeReplay) -> Slip | None:
    """Return when the hand came to the wrong object above which it stays at the end; else None.

    An object is to be picked up then, and none that any stage means is as near.
    """
    at_end = [above for above in replay.tried("above") if above.end is None]
    expected_roles = _expected_roles(replay.stages[replay.expected_stage])
    if not at_end or FactRole.RAISE not in expected_roles:
        return None
    came = at_end[0].start
    if came > replay.last_step - _APPROACH_STEPS:
        return None  # it may only pass
    names = frozenset(str(above.fact.place) for above in at_end)
    if names.isdisjoint(_objects_meant_by_any(replay, range(len(replay.stages)))):
        return Slip(came, "missed_grasp", names)
    return None


def _has_begun(replay: EpisodeReplay) -> bool:
    """Return whether the hand has done any act, or was at an object that the task is about."""
    acts = replay.started(FactRole.GRIP, FactRole.RAISE, FactRole.PRESS)
    if replay.expected_stage > 0 or any(acts):
        return True
    places = {approach.fact.place for approach in replay.started(FactRole.APPROACH)}
    places |= {above.fact.place for above in replay.tried("above")}
    meant = _objects_meant_by_any(replay, range(len(replay.stages)))
    return not places.isdisjoint(meant)
