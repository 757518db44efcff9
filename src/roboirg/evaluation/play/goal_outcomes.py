"""Which goals of a scene a trajectory reached, judged from the same events as the verdict."""

from __future__ import annotations

import functools
from collections.abc import Sequence
from dataclasses import dataclass
from typing import cast

from roboirg.core.episode import Episode
from roboirg.evaluation.records.record import GoalOutcomes, OriginalStatus
from roboirg.judging import Event, FailureAttribution, Status
from roboirg.judging.episode_replay import Decision, decide
from roboirg.language.worded_command import describe_goal
from roboirg.tasks import get_task, with_goal


@dataclass(frozen=True)
class PlayedCourse:
    """What happened in an episode; steps count since the world began.

    Attributes:
        episode: with the goal by which the verdict fell.
        events: all facts that changed, in order.
        policy_start_step: steps of the world before the policy's turn.
        elapsed_steps: steps of the world in all.
        original: the scene's own episode, if that of the verdict has another goal.
        original_status: how it ended for the original goal, as the environment says.
    """

    episode: Episode
    events: Sequence[Event]
    policy_start_step: int
    elapsed_steps: int
    original: Episode | None = None
    original_status: str | None = None

    @functools.cached_property
    def decision(self) -> Decision:
        """The verdict, which may have fallen before the end."""
        return decide(self.episode, self.events, self.elapsed_steps)

    @property
    def events_until_verdict(self) -> Sequence[Event]:
        """The events that the verdict is about."""
        return [event for event in self.events if event.step <= self.decision.step]


def find_goal_outcomes(trajectory: PlayedCourse) -> GoalOutcomes:
    """Return which goals of the scene were reached, and with which the wrong act agrees."""
    episode, (verdict, wrong_step) = trajectory.episode, trajectory.decision
    reached, agrees = [], []
    for goal in get_task(episode.task).goals(episode.scene):
        judge, step = decide(with_goal(episode, goal), trajectory.events, trajectory.elapsed_steps)
        if judge.status is Status.SUCCESS:
            reached.append(describe_goal(goal))
        lives_on = judge.status is Status.ONGOING or step > wrong_step
        ended_with_it = judge.status is Status.SUCCESS and step == wrong_step
        if verdict.violation is not None and (lives_on or ended_with_it):
            agrees.append(describe_goal(goal))
    status = "undecided" if trajectory.original_status == "ongoing" else trajectory.original_status
    return GoalOutcomes(
        stated=describe_goal(episode.goal),
        reached=tuple(reached),
        agrees=tuple(agrees),
        original=cast("OriginalStatus | None", status),
    )


def name_other_goal(
    found: FailureAttribution, original: Episode, goals: GoalOutcomes
) -> FailureAttribution:
    """Return ``other_goal`` for a failure of a policy that followed the scene's own goal instead.

    That is, it reached that goal, or its first wrong act agrees with it.
    """
    if goals.original != "success" and describe_goal(original.goal) not in goals.agrees:
        return found
    words = f"followed the other goal, which was not stated: {found.sentence[:-1]}"
    return FailureAttribution.of("other_goal", found.subject, found.step, words)
