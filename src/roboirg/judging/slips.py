"""What the hands tried and failed to do: misses, drops, releases and passes next to a place.

- *slip*: one such try.
- *hold*: from when the fingers close on an object until they let it go; a *raise* is while it is
  up. In one hold an object may be raised several times.
- *lost*: of an object that had been up, was let go, and did not come to a place where it was
  expected.
- *attempt*: what only the world can see, such as fingers that close on nothing (``clutched``), a
  hand that puts something down (``lowered``), or an object next to a place (``beside``).
"""

from __future__ import annotations

import functools
from collections.abc import Iterator, Sequence
from typing import NamedTuple

from roboirg.core.conditions import Fact, facts_of
from roboirg.core.fact_traits import FactRole
from roboirg.core.failures import FailureName
from roboirg.judging.episode_replay import EpisodeReplay, FactInterval

SETTLED_STEPS = 40
"""Control steps within which what was let go, or pressed, comes to its end."""

TREMOR_STEPS = 10
"""Control steps within which what the fingers hold again was not let go."""

RETRY_STEPS = 120
"""Control steps within which a hand that has missed an object holds it up, if it tries again."""

WOBBLE_STEPS = 18
"""Control steps within which an object that is over a place again has not been carried away."""

VISIT_STEPS = 40
"""Control steps for which the hand is above an object to which it went, and not past it."""

MISSES = ("missed_grasp", "missed_press")
"""Slips at which the hand did not reach its object; at all others it lost it, or passed a place."""

_PLACES_TO_FALL_INTO = ("bin", "box")
"""Kinds of places into which an object falls that is let go in the air."""
_PLACES_TO_REST = ("target", "site", *_PLACES_TO_FALL_INTO)
"""Kinds of places at which an object comes to rest that is put down."""


class Slip(NamedTuple):
    """One failed try.

    Attributes:
        step: when; since the world began.
        failure: ``missed_grasp``, ``missed_press``, ``dropped``, ``misplaced`` or ``wrong_place``.
        subjects: names of the objects that it can have been about; several if it is not clear.
    """

    step: int
    failure: FailureName
    subjects: frozenset[str]


# Cached: what explains a failure asks for the slips of one replay again and again.
@functools.lru_cache(maxsize=1)
def find_slips(replay: EpisodeReplay) -> tuple[Slip, ...]:
    """Return all failed tries of the policy's turn, in the order of their steps."""
    slips = [
        *_missed_grasps(replay),
        *_missed_presses(replay),
        *_lost_objects(replay),
        *_missed_passes(replay),
    ]
    slips += _empty_rounds(replay, slips)
    slips.sort(key=lambda slip: slip.step)
    return tuple(slips)


def drop_before(replay: EpisodeReplay, act: FactInterval) -> Slip | None:
    """Return the drop by which an object came to lie at a place; None if it was put there.

    A hand at rest that opens low over the place has aimed at it.
    """
    for slip in find_slips(replay):
        is_recent = act.start - SETTLED_STEPS <= slip.step <= act.start
        if slip.failure == "dropped" and act.subject in slip.subjects and is_recent:
            facts_before = replay.facts[slip.step - 1]
            is_at_rest = Fact("still", "robot") in facts_before
            is_over = any(_is_carry_over(fact, act.fact) for fact in facts_before)
            return None if is_at_rest and is_over else slip
    return None


def _is_carry_over(fact: Fact, act: Fact) -> bool:
    """Return whether a fact is that an object is over the place that an act with it is about."""
    return fact.traits.role is FactRole.CARRY and act._replace(kind=fact.kind) == fact


def unsteady_visit(replay: EpisodeReplay, visit: FactInterval) -> Slip | None:
    """Return how an unsteady hand came to carry an object over a place that was not due.

    It wobbled: the object was over this place within the last `WOBBLE_STEPS`. Or it had missed the
    place that was due, and went on. None if neither explains the visit.
    """
    for facts in replay.facts[max(visit.start - WOBBLE_STEPS, 0) : visit.start]:
        if visit.fact in facts:
            return Slip(visit.start, "misplaced", frozenset({visit.subject}))
    due_stage = replay.expected_stages[visit.start]
    for slip in find_slips(replay):
        is_pass = slip.failure == "misplaced" and visit.subject in slip.subjects
        if is_pass and slip.step < visit.start and replay.expected_stages[slip.step] == due_stage:
            return slip
    return None


def is_noticed(replay: EpisodeReplay, slip: Slip) -> bool:
    """Return whether the hands, after they missed something, next tried the same again.

    Missed the red cube, then took it: noticed. Missed it, then opened an empty hand at the bin,
    pressed, or took another object: not noticed. If it took the cube, or tried to again and never
    did, only after `RETRY_STEPS`, it did the rest of the round before. The loss of an object never
    counts as noticed: where one is handled several times, a new pick may be the next one that is
    due.
    """
    if slip.failure not in MISSES:
        return False
    all_acts = _acts_and_tries(replay, find_slips(replay))
    later_acts = [act for act in all_acts if act.step > slip.step]
    next_act = min(later_acts, key=lambda act: act.step, default=None)
    if next_act is None or next_act.subjects.isdisjoint(slip.subjects):
        return False
    for lift in replay.started(FactRole.RAISE, after=slip.step):
        if lift.subject in slip.subjects:
            return lift.start - slip.step <= RETRY_STEPS
    return next_act.step - slip.step <= RETRY_STEPS


class _Act(NamedTuple):
    """Something that the hands did, or tried: when, and with which objects if with any."""

    step: int
    subjects: frozenset[str]


def _acts_and_tries(replay: EpisodeReplay, slips: Sequence[Slip]) -> Iterator[_Act]:
    """Yield all that the hands did or tried, with the objects it was about, in no order.

    An empty hand that opens is an act about no object.
    """
    for act in replay.started(FactRole.RAISE, FactRole.PRESS):
        yield _Act(act.start, frozenset({act.subject}))
    for slip in slips:
        yield _Act(slip.step, slip.subjects)
    for emptied in replay.tried("emptied"):
        yield _Act(emptied.start, frozenset())


def _missed_grasps(replay: EpisodeReplay) -> Iterator[Slip]:
    """Yield the failed tries to take something: it was not lifted.

    The fingers closed on nothing next to it, they held it for a while without lifting it, they
    were at what is expected and did not close, or they pushed it.
    """
    missed = list(replay.tried("clutched"))
    for hold in _holds_let_go(replay):
        if not _lifts_during(replay, hold):
            missed.append(hold)
    closed = [*missed, *replay.started(FactRole.GRIP, after=0)]
    touches = list(_idle_touches(replay, [interval.start for interval in closed]))
    pushes = _pushes(replay, [interval.start for interval in (*closed, *touches)])
    missed += [*touches, *pushes]
    # Several objects that were missed at the same step are one try: it is not clear at which.
    names_by_step: dict[int, set[str]] = {}
    for interval in missed:
        names_by_step.setdefault(interval.start, set()).add(interval.subject)
    for step, names in names_by_step.items():
        yield Slip(step, "missed_grasp", frozenset(names))


def _idle_touches(replay: EpisodeReplay, closing_steps: Sequence[int]) -> Iterator[FactInterval]:
    """Yield when the hand was at an object that was expected, and the fingers did not close.

    They close neither then nor in the `SETTLED_STEPS` after it. `closing_steps` are all steps at
    which they closed, on an object or on nothing.
    """
    for touch in replay.started(FactRole.TOUCH):
        end = replay.end_of(touch) + SETTLED_STEPS
        has_closed = any(touch.start <= step <= end for step in closing_steps)
        expected = facts_of(replay.stage_at(touch.start).expects)
        is_expected = any(fact.subject == touch.subject for fact in expected)
        if is_expected and not has_closed:
            yield touch


def _pushes(replay: EpisodeReplay, other_tries: Sequence[int]) -> Iterator[FactInterval]:
    """Yield when the hand pushed an object to which it went, instead of taking it.

    A push within `SETTLED_STEPS` of another try, such as fingers that close, belongs to that one.
    `other_tries` are the steps of all of them.
    """
    for push in replay.tried("pushed"):
        first = push.start - SETTLED_STEPS
        last = replay.end_of(push) + SETTLED_STEPS
        is_part_of_try = any(first <= step <= last for step in other_tries)
        if not is_part_of_try and _is_in_visit(replay, push):
            yield push


def _is_in_visit(replay: EpisodeReplay, push: FactInterval) -> bool:
    """Return whether the hand went to what it pushed: it stays above it for `VISIT_STEPS`."""
    for above in replay.tried("above"):
        end = replay.end_of(above)
        is_meanwhile = above.start <= push.start <= end
        if above.fact.place == push.subject and is_meanwhile:
            return end - above.start >= VISIT_STEPS
    return False


def _holds_let_go(replay: EpisodeReplay) -> Iterator[FactInterval]:
    """Yield from when to when the fingers held each object; not what they hold at the end.

    Fingers that tremble lose an object and hold it again within a few steps: that is no end of a
    hold.
    """
    grips = list(replay.started(FactRole.GRIP))
    grip_starts = {(grip.subject, grip.start) for grip in grips}
    for grip in grips:
        if grip.end is None:
            continue
        steps_after = range(grip.end, grip.end + TREMOR_STEPS)
        is_held_again = any((grip.subject, step) in grip_starts for step in steps_after)
        if not is_held_again:
            yield grip


def _lifts_during(replay: EpisodeReplay, hold: FactInterval) -> list[FactInterval]:
    """Return from when to when a held object was lifted, of lifts during this hold."""
    hold_end = replay.end_of(hold)
    lifts = []
    for lift in replay.started(FactRole.RAISE, after=0):
        is_same_object = lift.subject == hold.subject
        is_meanwhile = lift.start <= hold_end and lift.lasts_until(hold.start)
        if is_same_object and is_meanwhile:
            lifts.append(lift)
    return lifts


def _empty_rounds(replay: EpisodeReplay, slips: Sequence[Slip]) -> Iterator[Slip]:
    """Yield each empty hand that put down, at a place, what it had gone to just before.

    It was above the object after the last act or slip, so no other slip says how it missed it: it
    pushed the object, or closed its fingers too high.
    """
    act_steps = [act.step for act in _acts_and_tries(replay, slips)]
    for emptied in replay.tried("emptied"):
        last_act = max((step for step in act_steps if step < emptied.start), default=0)
        names = set()
        for above in replay.tried("above"):
            is_latest = last_act < above.start < emptied.start
            if is_latest and replay.end_of(above) - above.start >= VISIT_STEPS:
                names.add(str(above.fact.place))
        # A hand that opens at a cube begins a grasp, and a target may be next to the button.
        is_at_button = FactRole.APPROACH in replay.roles_at(emptied.start)
        if names and emptied.fact.place not in names and not is_at_button:
            yield Slip(emptied.start, "missed_grasp", frozenset(names))


def _missed_presses(replay: EpisodeReplay) -> Iterator[Slip]:
    """Yield each try to press a button next to which closed fingers came down without pressing it.

    The button counts as pressed if it was from `SETTLED_STEPS` before they came down until they are
    up again.
    """
    presses = list(replay.started(FactRole.PRESS))
    for attempt in replay.tried("pressed_beside"):
        first = attempt.start - SETTLED_STEPS
        last = replay.end_of(attempt) + 1
        pressed_buttons = [press.subject for press in presses if first <= press.start <= last]
        if attempt.subject not in pressed_buttons:
            yield Slip(attempt.start, "missed_press", frozenset({attempt.subject}))


class _Release(NamedTuple):
    """The moment at which an object that had been up was let go.

    Attributes:
        step: when.
        name: of the object.
        is_in_air: whether it was let go above the table.
        expected: what the stage expects of the object then.
    """

    step: int
    name: str
    is_in_air: bool
    expected: tuple[Fact, ...]

    @property
    def roles(self) -> set[FactRole]:
        """The roles of what is expected, but for being up and being let go."""
        return {fact.traits.role for fact in self.expected} - {FactRole.RAISE, FactRole.RELEASE}

    @property
    def places(self) -> tuple[str, ...]:
        """The kinds of places to which the object can come."""
        return _PLACES_TO_FALL_INTO if self.is_in_air else _PLACES_TO_REST


def _lost_objects(replay: EpisodeReplay) -> Iterator[Slip]:
    """Yield each object that was lifted, let go, and did not come to a place where it was expected.

    Letting go is no loss if the stage expects nothing more of the object, or if the object was put
    down and is not to come to a place.
    """
    for release in _releases(replay):
        can_be_lost = release.is_in_air or FactRole.PLACING in release.roles
        if release.roles and can_be_lost and not _has_landed(replay, release):
            failure = _failure_of_loss(replay, release)
            yield Slip(release.step, failure, frozenset({release.name}))


def _releases(replay: EpisodeReplay) -> Iterator[_Release]:
    """Yield the moments at which the hand let go of an object that it had lifted.

    It was in the air if it was still up, and the hand had not lowered it to put it down. What the
    current stage expects of the object goes with it.
    """
    for hold in _holds_let_go(replay):
        raises = _lifts_during(replay, hold)
        if not raises:
            continue
        step = replay.end_of(hold)
        name = hold.subject
        lowered = replay.tried("lowered", name)
        is_lowered = any(low.start < step and low.lasts_until(step) for low in lowered)
        is_in_air = raises[-1].lasts_until(step) and not is_lowered
        expected_facts = facts_of(replay.stage_at(step).expects)
        of_object = tuple(fact for fact in expected_facts if fact.subject == name)
        yield _Release(step, name, is_in_air, of_object)


def _has_landed(replay: EpisodeReplay, release: _Release) -> bool:
    """Return whether an object that was let go soon lies at a place that is good for it.

    That is an expected place, or one of a kind to which it can come. Soon is within
    `SETTLED_STEPS`.
    """
    for facts in replay.facts[release.step : release.step + SETTLED_STEPS]:
        for fact in facts:
            if fact.subject != release.name or fact.traits.role is not FactRole.PLACING:
                continue
            kind = replay.episode.scene[str(fact.place)].kind
            if fact in release.expected or kind in release.places:
                return True
    return False


def _failure_of_loss(replay: EpisodeReplay, release: _Release) -> FailureName:
    """Return which failure the loss of an object is, by the places next to which it was let go.

    Next to the place where it is expected -> ``misplaced``; next to another place, or on another
    object -> ``wrong_place``; else ``dropped`` from the air, ``misplaced`` on the table.
    """
    places_nearby: set[str | None] = set()
    for carried in replay.tried("beside", release.name):
        place = carried.fact.place
        kind = replay.episode.scene[str(place)].kind
        is_now = carried.start <= release.step and carried.lasts_until(release.step - 1)
        if is_now and kind in release.places:
            places_nearby.add(place)
    if any(fact.place in places_nearby for fact in release.expected):
        return "misplaced"
    if places_nearby or _stands_on_another(replay, release):
        return "wrong_place"
    return "dropped" if release.is_in_air else "misplaced"


def _stands_on_another(replay: EpisodeReplay, release: _Release) -> bool:
    """Return whether an object that was put down stands on another: it is not held, nor lies."""
    settled = min(release.step + SETTLED_STEPS, replay.last_step)
    is_lying = Fact("lying", release.name) in replay.facts[settled]
    return not (release.is_in_air or is_lying or FactRole.GRIP in replay.roles_at(settled))


def _missed_passes(replay: EpisodeReplay) -> Iterator[Slip]:
    """Yield each try to carry an object over a place that only came next to it.

    It is due there, now or later; it was up, and not over the place before it was away again.
    """
    for attempt in replay.tried("beside"):
        carry = _carry_due(replay, attempt)
        is_up = FactRole.RAISE in replay.roles_at(attempt.start)
        meanwhile = replay.facts[attempt.start : replay.end_of(attempt) + 1]
        if carry is not None and is_up and not any(carry in facts for facts in meanwhile):
            yield Slip(attempt.start, "misplaced", frozenset({attempt.subject}))


def _carry_due(replay: EpisodeReplay, attempt: FactInterval) -> Fact | None:
    """Return the fact, due now or later, that an object gets over the place next to which it is."""
    due_stage = max(replay.expected_stages[attempt.start], 0)
    for stage in replay.stages[due_stage:]:
        for fact in facts_of(stage.expects):
            if _is_carry_over(fact, attempt.fact):
                return fact
    return None
