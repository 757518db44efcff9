"""Which goals of a scene a trajectory reached, judged from the same events as the verdict."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any, cast

from roboirg.core.conditions import Fact
from roboirg.core.episode import Episode
from roboirg.judging import Event, FailureAttribution, Status
from roboirg.judging.episode_replay import Decision, decide
from roboirg.language.arms import TrialWords
from roboirg.language.goal_fields import goal_name
from roboirg.records.record import EventRecord, GoalOutcomes, OriginalStatus


def judged_events(events: Iterable[EventRecord], start: int) -> list[Event]:
    """Return recorded events as the judge takes them.

    Args:
        events: of a record, whose steps count from the begin of the policy's turn.
        start: step of the episode at which that began; the judge's steps count from the episode's.
    """
    judged = []
    for event in events:
        fact = Fact(event.kind, event.subject, event.place)
        judged.append(Event(event.step + start, fact, event.holds))
    return judged


def recorded_events(events: Iterable[Mapping[str, Any]], start: int) -> tuple[EventRecord, ...]:
    """Return the events of an environment for records, the reverse of `judged_events`."""
    recorded = []
    for event in events:
        place = event.get("place")
        record = EventRecord(
            step=int(event["step"]) - start,
            kind=str(event["kind"]),
            subject=str(event["subject"]),
            place=None if place is None else str(place),
            holds=bool(event.get("holds", True)),
        )
        recorded.append(record)
    return tuple(recorded)


def find_goal_outcomes(
    words: TrialWords,
    events: Sequence[Event],
    elapsed_steps: int,
    decision: Decision,
    original: str | None = None,
) -> GoalOutcomes:
    """Return which goals of the scene were reached, and which would fit the act that was wrong.

    If an act decided the failure, another goal may have been meant: one that the act reached, or
    that was still possible after it.

    Args:
        words: of the trial, with the scene's goals.
        events: all facts that changed, in order; steps count since the world began.
        elapsed_steps: steps of the world in all.
        decision: the verdict, which may have fallen before the end.
        original: how it ended for the scene's own goal, if the episode has another one.
    """
    reached = []
    agrees = []
    for goal, episode in words.goals.items():
        outcome = decide(episode, events, elapsed_steps)
        is_reached = outcome.judge.status is Status.SUCCESS
        if is_reached:
            reached.append(goal)
        if not decision.judge.violation:  # no act was wrong, so none can fit another goal
            continue
        is_still_possible = outcome.judge.status is Status.ONGOING or outcome.step > decision.step
        is_reached_by_act = is_reached and outcome.step == decision.step
        if is_still_possible or is_reached_by_act:
            agrees.append(goal)
    if original == "ongoing":  # in a record the episode is over
        original = "undecided"
    return GoalOutcomes(
        stated=words.stated,
        reached=tuple(reached),
        agrees=tuple(agrees),
        original=cast("OriginalStatus | None", original),
    )


def name_other_goal(
    found: FailureAttribution, original: Episode, goals: GoalOutcomes
) -> FailureAttribution:
    """Return ``other_goal`` for a failure of a policy that followed the scene's own goal instead.

    That is, it reached that goal, or its first wrong act agrees with it.
    """
    if goals.original != "success" and goal_name(original.goal) not in goals.agrees:
        return found
    words = f"followed the other goal, which was not stated: {found.sentence[:-1]}"
    return FailureAttribution.of("other_goal", found.subject, found.step, words)
