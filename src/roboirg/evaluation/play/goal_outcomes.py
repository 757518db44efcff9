"""Which goals of a scene a trajectory reached, judged from the same events as the verdict."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any, cast

from roboirg.core.conditions import Fact
from roboirg.core.episode import Episode
from roboirg.evaluation.records.record import EventRecord, GoalOutcomes, OriginalStatus
from roboirg.judging import Event, FailureAttribution, Status
from roboirg.judging.episode_replay import Decision, decide
from roboirg.language.arms import TrialWords
from roboirg.language.goal_fields import goal_name


def judged_events(events: Iterable[EventRecord], start: int) -> list[Event]:
    """Return recorded events as the judge sees them, for a policy's turn that began at a step."""
    return [
        Event(one.step + start, Fact(one.kind, one.subject, one.place), one.holds) for one in events
    ]


def recorded_events(events: Iterable[Mapping[str, Any]], start: int) -> tuple[EventRecord, ...]:
    """Return the events of an environment for records, the reverse of `judged_events`."""
    return tuple(
        EventRecord(
            step=int(event["step"]) - start,
            kind=str(event["kind"]),
            subject=str(event["subject"]),
            place=None if event.get("place") is None else str(event["place"]),
            holds=bool(event.get("holds", True)),
        )
        for event in events
    )


def find_goal_outcomes(
    words: TrialWords,
    events: Sequence[Event],
    elapsed_steps: int,
    decision: Decision,
    original: str | None = None,
) -> GoalOutcomes:
    """Return which goals of the scene were reached, and with which the wrong act agrees.

    Args:
        words: of the trial, with the scene's goals.
        events: all facts that changed, in order; steps count since the world began.
        elapsed_steps: steps of the world in all.
        decision: the verdict, which may have fallen before the end.
        original: how it ended for the scene's own goal, if the episode has another one.
    """
    reached, agrees = [], []
    for goal, episode in words.goals.items():
        judge, step = decide(episode, events, elapsed_steps)
        is_reached = judge.status is Status.SUCCESS
        if is_reached:
            reached.append(goal)
        lives_on = judge.status is Status.ONGOING or step > decision.step
        if decision.judge.violation and (lives_on or (is_reached and step == decision.step)):
            agrees.append(goal)
    return GoalOutcomes(
        stated=words.stated,
        reached=tuple(reached),
        agrees=tuple(agrees),
        original=cast("OriginalStatus", "undecided" if original == "ongoing" else original),
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
