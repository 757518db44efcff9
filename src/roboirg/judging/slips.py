"""What the hands tried and failed to do: misses, drops, releases and passes next to a place."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import chain
from typing import NamedTuple

from roboirg.core.conditions import facts_of
from roboirg.core.fact_traits import FactRole
from roboirg.core.failures import FailureName
from roboirg.judging.episode_replay import EpisodeReplay, FactInterval

SETTLED_STEPS = 40
"""Control steps within which what was let go, or pressed, comes to its end."""

TREMOR_STEPS = 10
"""Control steps within which what the fingers hold again was not let go."""


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


def find_slips(replay: EpisodeReplay) -> tuple[Slip, ...]:
    """Return all failed tries of the policy's turn, in order."""
    parts = (_missed_grasps(replay), _missed_presses(replay), _lost(replay), _passes(replay))
    return tuple(sorted(chain(*parts), key=lambda slip: slip.step))


def drop_before(slips: Sequence[Slip], act: FactInterval) -> Slip | None:
    """Return the drop by which an object came to lie at a place; None if it was put there."""
    name, start = act.fact.subject, act.start
    drops = (one for one in slips if one.failure == "dropped" and name in one.subjects)
    return next((one for one in drops if start - SETTLED_STEPS <= one.step <= start), None)


def is_noticed(replay: EpisodeReplay, slip: Slip, slips: Sequence[Slip]) -> bool:
    """Return whether the next that the hands did after a miss was to try the same again.

    An empty hand at a place, a press, or another object shows that it went unnoticed. Whether a
    loss was noticed does not show: where an object is handled several times, both look alike.
    """
    if slip.failure not in ("missed_grasp", "missed_press"):
        return False
    roles = (FactRole.RAISE, FactRole.PRESS)
    acts = [(one.start, {one.fact.subject}) for one in replay.started(*roles, after=slip.step)]
    acts += [(one.step, set(one.subjects)) for one in slips if one.step > slip.step]
    acts += [(one.start, set()) for one in replay.tried("emptied") if one.start > slip.step]
    _, subjects = min(acts, default=(0, set()), key=lambda act: act[0])
    return bool(subjects & slip.subjects)


def _missed_grasps(replay: EpisodeReplay) -> Iterator[Slip]:
    """Yield where the hands meant to take something, and did not lift it.

    Fingers closed on nothing next to it, held it for a while, or were where they take what is
    expected and did not close.
    """
    missed = [*replay.tried("clutched")]
    missed += [one for one in _holds(replay) if not _raises(replay, one)]
    grips = [one.start for one in (*missed, *replay.started(FactRole.GRIP, after=0))]
    for one in replay.started(FactRole.TOUCH):
        end = replay.last_step if one.end is None else one.end + SETTLED_STEPS
        expected = {fact.subject for fact in facts_of(replay.stage_at(one.start).expects)}
        if one.fact.subject in expected and not any(one.start <= grip <= end for grip in grips):
            missed.append(one)
    closed: dict[int, set[str]] = {}
    for one in missed:
        closed.setdefault(one.start, set()).add(one.fact.subject)
    yield from (Slip(step, "missed_grasp", frozenset(names)) for step, names in closed.items())


def _holds(replay: EpisodeReplay) -> list[FactInterval]:
    """Return when the fingers held something, until they let it go; not what they still hold."""
    grips = list(replay.started(FactRole.GRIP))
    starts = {(one.fact.subject, one.start) for one in grips}
    return [
        one
        for one in grips
        if one.end is not None
        if not any((one.fact.subject, one.end + late) in starts for late in range(TREMOR_STEPS))
    ]


def _raises(replay: EpisodeReplay, hold: FactInterval) -> list[FactInterval]:
    """Return the intervals in which an object was up while, or just before, it was held."""
    raised = replay.started(FactRole.RAISE, after=0)
    own = [one for one in raised if one.fact.subject == hold.fact.subject]
    end = replay.last_step if hold.end is None else hold.end
    return [one for one in own if one.start <= end and (one.end or end) >= hold.start]


def _missed_presses(replay: EpisodeReplay) -> Iterator[Slip]:
    presses = list(replay.started(FactRole.PRESS))
    for one in replay.tried("pressed_beside"):
        end = replay.last_step if one.end is None else one.end
        if not any(
            press.fact.subject == one.fact.subject
            and one.start - SETTLED_STEPS <= press.start <= end + 1
            for press in presses
        ):
            yield Slip(one.start, "missed_press", frozenset({one.fact.subject}))


def _lost(replay: EpisodeReplay) -> Iterator[Slip]:
    """Yield where an object that had been up was let go and did not come to an expected place."""
    for hold in _holds(replay):
        raises, step, name = _raises(replay, hold), hold.end or 0, hold.fact.subject
        expected = {
            fact for fact in facts_of(replay.stage_at(step).expects) if fact.subject == name
        }
        roles = {fact.traits.role for fact in expected} - {FactRole.RAISE, FactRole.RELEASE}
        if not raises or not roles:
            continue
        lowered = any(
            one.start < step <= (one.end or step) for one in replay.tried("lowered", name)
        )
        in_air = (raises[-1].end or step) >= step and not lowered
        kinds = ("bin", "box") if in_air else ("target", "site", "bin", "box")
        landed = {
            fact
            for facts in replay.facts[step : step + SETTLED_STEPS]
            for fact in facts
            if fact.subject == name and fact.traits.role is FactRole.PLACING
            if fact in expected or replay.episode.scene[str(fact.place)].kind in kinds
        }
        if not landed and (FactRole.PLACING in roles or in_air):
            near = _places_near(replay, name, step, kinds)
            is_right = near & {fact.place for fact in expected}
            is_put = is_right if in_air else not near or is_right
            other: FailureName = "wrong_place" if near else "dropped"
            yield Slip(step, "misplaced" if is_put else other, frozenset({name}))


def _places_near(
    replay: EpisodeReplay, name: str, step: int, kinds: tuple[str, ...]
) -> set[str | None]:
    """Return the places of some kinds next to which an object was let go at a step."""
    beside = replay.tried("beside", name)
    near = {one.fact.place for one in beside if one.start <= step <= (one.end or step) + 1}
    return {one for one in near if replay.episode.scene[str(one)].kind in kinds}


def _passes(replay: EpisodeReplay) -> Iterator[Slip]:
    """Yield where an object was carried past a place over which it was expected."""
    over = list(replay.started(FactRole.CARRY))
    for one in replay.tried("beside"):
        end = replay.last_step if one.end is None else one.end
        expected = facts_of(replay.stage_at(one.start).expects)
        wanted = {f for f in expected if f[1:] == one.fact[1:] and f.traits.role is FactRole.CARRY}
        if wanted and not any(it.fact in wanted and one.start <= it.start <= end for it in over):
            yield Slip(one.start, "misplaced", frozenset({one.fact.subject}))
