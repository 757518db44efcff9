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
    """Return the events of a record, facts that became true or false, as the judge takes them.

    Args:
        events: their control steps count from the begin of the policy's turn.
        start: control step at which that turn began; steps for the judge count from the begin of
            the episode, which may show a video first.
    """
    judged = []
    for event in events:
        fact = Fact(event.kind, event.subject, event.place)
        judged.append(Event(event.step + start, fact, event.holds))
    return judged


def recorded_events(events: Iterable[Mapping[str, Any]], start: int) -> tuple[EventRecord, ...]:
    """Return the events that an environment reports, facts that changed, for a record.

    Args:
        events: with ``step``, ``kind``, ``subject``, ``place`` and ``holds``.
        start: control step at which the policy's turn began; recorded steps count from there.
    """
    recorded = []
    for event in events:
        step = event["step"] - start
        recorded.append(EventRecord(**{**event, "step": step}))
    return tuple(recorded)


def find_goal_outcomes(
    words: TrialWords,
    events: Sequence[Event],
    elapsed_steps: int,
    decision: Decision,
    original: str | None = None,
) -> GoalOutcomes:
    """Return which goals of the scene a trajectory reached, and which a wrong act agrees with.

    If an act made the episode fail, the policy may have followed another goal: one that the act
    reached, or that was still possible after it. The act agrees with those.

    Args:
        words: of the trial, with the scene's goals.
        events: all facts that changed, in order; steps count since the world began.
        elapsed_steps: steps of the world in all.
        decision: the verdict on the stated goal, which may have fallen before the end.
        original: status of the scene's own goal at the end, if the words state another one.
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
    """Return the failure ``other_goal`` if a policy followed the scene's own goal instead.

    In such an episode the words state another goal than the scene's own. The policy followed the
    latter if it reached it, or if its first wrong act agrees with it.

    Args:
        found: why the policy failed, which is returned if it did not follow the other goal.
        original: the episode with the scene's own goal.
        goals: which goals were reached.
    """
    if goals.original != "success" and goal_name(original.goal) not in goals.agrees:
        return found
    words = f"followed the other goal, which was not stated: {found.sentence[:-1]}"
    return FailureAttribution.of("other_goal", found.subject, found.step, words)
