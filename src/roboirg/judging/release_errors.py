"""Releases next to the expected place, failed grasps, and the early acts that they excuse.

An act that comes too early may be right: a policy that drops its cube next to the target and goes
on has counted correctly. So the episode is judged again as if each release had been at its
expected place. If the act is allowed then, the first such release is the failure. An act after a
failed grasp is excused if it skips nothing but what needs that grasp.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

from roboirg.core.conditions import Fact, facts_of
from roboirg.core.fact_traits import FactRole
from roboirg.judging.episode_replay import EpisodeReplay, FactInterval
from roboirg.judging.failure_attribution import FailureAttribution
from roboirg.judging.judge import Judge, Status, describe_expected, describe_object


class MisplacedRelease(NamedTuple):
    """A picked object that came to lie next to its expected place.

    Attributes:
        missing: the placing that the stage expected.
        grip: the last interval in which the object was picked.
        start: the step from which on it lay there.
        end: the step at which it was picked again; None if it was not.
    """

    missing: Fact
    grip: FactInterval
    start: int
    end: int | None


def find_excusing_release(replay: EpisodeReplay, act: Fact) -> FailureAttribution | None:
    """Return the failed release or grasp that made a right act too early; None if there is none."""
    current = replay.expected_stage
    later = [
        index
        for index in range(current + 1, len(replay.stages))
        if act in facts_of(replay.stages[index].expects)
    ]
    if not later:
        return None
    releases = list(_misplaced_releases(replay))
    if releases and _is_allowed(replay, releases):
        return describe_release(replay, releases[0].grip, releases[0].start)
    expects = replay.stages[current].expects
    if [stage.expects for stage in replay.stages[current : later[0]]].count(expects) == 1:
        return describe_missed_grasp(replay, facts_of(expects))
    return None


def describe_missed_grasp(
    replay: EpisodeReplay, wanted: tuple[Fact, ...]
) -> FailureAttribution | None:
    """Return the last failed attempt in the current stage to pick something up, if there is one."""
    subjects = {fact.subject for fact in wanted if fact.traits.role is FactRole.RAISE}
    attempts = replay.started(FactRole.TOUCH, FactRole.GRIP, after=replay.expected_since)
    attempt = max(
        (interval for interval in attempts if interval.fact.subject in subjects),
        key=lambda interval: interval.start,
        default=None,
    )
    if attempt is None:
        return None
    name = attempt.fact.subject
    words = f"reached {describe_object(name, replay.episode.scene)} without lifting it"
    return FailureAttribution.of(
        "missed_grasp", name, attempt.start, f"{words}; {expected_action(replay)}"
    )


def describe_release(replay: EpisodeReplay, grip: FactInterval, step: int) -> FailureAttribution:
    """Return the failure of an object that was released next to its expected place.

    `grip` is the last interval in which it was picked or lifted; `step` is when it lay there.
    """
    name = grip.fact.subject
    words = describe_object(name, replay.episode.scene)
    expected = expected_action(replay, replay.expected_stages[step])
    if grip.end is not None and Fact("held", name) in replay.facts[grip.end]:
        return FailureAttribution.of(
            "misplaced", name, step, f"put {words} down next to its place; {expected}"
        )
    return FailureAttribution.of("dropped", name, step, f"dropped {words}; {expected}")


def expected_action(replay: EpisodeReplay, stage: int | None = None) -> str:
    """Return what a stage expects, in words; by default the one that is current at the end."""
    index = replay.expected_stage if stage is None else stage
    return describe_expected(replay.stages[max(index, 0)])


def _misplaced_releases(replay: EpisodeReplay) -> Iterator[MisplacedRelease]:
    picks = list(replay.started(FactRole.RAISE, after=replay.policy_start_step))
    for rest in replay.started(FactRole.RELEASE, after=replay.policy_start_step):
        name, start = rest.fact.subject, rest.start
        own = [pick for pick in picks if pick.fact.subject == name]
        grips = [pick for pick in own if pick.end is not None and pick.end <= start]
        end = min((pick.start for pick in own if pick.start > start), default=None)
        missing = _expected_placing(replay, name, start)
        if grips and missing is not None and not _occurs(replay, missing, start, end):
            yield MisplacedRelease(missing, max(grips, key=lambda pick: pick.start), start, end)


def _expected_placing(replay: EpisodeReplay, name: str, step: int) -> Fact | None:
    """Return the placing of an object that is expected at a step, if there is one."""
    stage = replay.stages[max(replay.expected_stages[step], 0)]
    placings = (f for f in facts_of(stage.expects) if f.traits.role is FactRole.PLACING)
    return next((fact for fact in placings if fact.subject == name), None)


def _occurs(replay: EpisodeReplay, fact: Fact, start: int, end: int | None) -> bool:
    """Return whether a fact holds at any step from `start` until before `end`."""
    return any(fact in facts for facts in replay.facts[start:end])


def _is_allowed(replay: EpisodeReplay, releases: list[MisplacedRelease]) -> bool:
    """Return whether no rule is violated if each release was at its expected place."""
    judge = Judge((*replay.episode.demonstration, *replay.stages), replay.episode.scene)
    for step, facts in enumerate(replay.facts):
        credit = {release.missing for release in releases if _is_credited(release, step)}
        judge.update(step, facts | credit if credit else facts)
    return judge.status is not Status.FAILURE


def _is_credited(release: MisplacedRelease, step: int) -> bool:
    lasts = release.end is None or release.missing.traits.lasts
    return release.start <= step and (lasts or step < (release.end or 0))
