"""Policies that take a goal from the episodes, whatever the instruction says.

`OraclePolicy` is the upper bound. The other two cheat in a way that control arms find out: an *arm*
plays an episode again with other words, or with another goal.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, ClassVar

from roboirg.core.episode import Goal
from roboirg.policies.builtin.scripted import WORDLESS, ScriptedPolicy
from roboirg.tasks import get_task
from roboirg.tasks.splits.splits import get_episode, split_size

if TYPE_CHECKING:
    from roboirg.envs.environment import RoboIRGEnv


class OraclePolicy(ScriptedPolicy):
    """Executes the true goal: the upper bound, and the proof that an episode can be solved."""

    listens: ClassVar[bool] = False
    metadata: ClassVar[Mapping[str, str]] = WORDLESS

    def decide(self, env: RoboIRGEnv, instruction: str) -> Goal | None:  # noqa: ARG002
        """Return the goal of the episode that is played; the instruction is ignored."""
        return env.episode.goal


class HabitPolicy(OraclePolicy):
    """Executes the scene's own goal whatever is said, as a policy that knows its scenes by heart.

    It succeeds in every arm but ``other-goal``, which replaces that goal by another one.
    """

    def decide(self, env: RoboIRGEnv, instruction: str) -> Goal:  # noqa: ARG002
        """Return the goal that the scene has in the split, also where an arm has replaced it."""
        return (env.original or env.episode).goal


class PreviousGoalPolicy(OraclePolicy):
    """Executes the goal of the episode before, as if the words of that one were still there.

    If the scene does not have that goal, it holds still.
    """

    def decide(self, env: RoboIRGEnv, instruction: str) -> Goal | None:  # noqa: ARG002
        """Return the goal of the split's previous episode; None if this scene has no such goal.

        Before the first episode comes the last one of the split.
        """
        episode = env.episode
        before = (episode.index - 1) % split_size(episode.split)
        goal = get_episode(episode.task, episode.split, before).goal
        goals = get_task(episode.task).goals(episode.scene)
        return goal if goal in goals else None
