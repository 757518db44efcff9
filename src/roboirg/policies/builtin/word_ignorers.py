"""Policies that ignore what is said and have the hands of the oracle: what control arms find."""

from __future__ import annotations

from typing import TYPE_CHECKING

from roboirg.core.episode import Goal
from roboirg.policies.builtin.oracle_policy import OraclePolicy
from roboirg.tasks import get_task
from roboirg.tasks.splits.splits import get_episode, split_size

if TYPE_CHECKING:
    from roboirg.envs.environment import RoboIRGEnv


class HabitPolicy(OraclePolicy):
    """Executes the scene's own goal whatever is said, as a policy that knows its scenes by heart.

    It succeeds in every arm but ``other-goal``.
    """

    def decide(self, env: RoboIRGEnv, instruction: str) -> Goal:  # noqa: ARG002
        """Return the scene's own goal."""
        return (env.original or env.episode).goal


class PreviousGoalPolicy(OraclePolicy):
    """Executes the goal of the episode before, as if the words of that one were still there.

    If the scene does not have that goal, it holds still.
    """

    def decide(self, env: RoboIRGEnv, instruction: str) -> Goal | None:  # noqa: ARG002
        """Return the goal of the split's episode before this one, of the last before the first."""
        episode = env.episode
        before = (episode.index - 1) % split_size(episode.split)
        goal = get_episode(episode.task, episode.split, before).goal
        return goal if goal in get_task(episode.task).goals(episode.scene) else None
