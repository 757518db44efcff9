"""The oracle: knows the goal and the poses of all objects."""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar

from roboirg.core.episode import Goal
from roboirg.policies.builtin.scripted import ScriptedPolicy

if TYPE_CHECKING:
    from roboirg.envs.environment import RoboIRGEnv


class OraclePolicy(ScriptedPolicy):
    """Executes the true goal: the upper bound, and the proof that an episode can be solved."""

    listens: ClassVar[bool] = False

    def decide(self, env: RoboIRGEnv, instruction: str) -> Goal:  # noqa: ARG002
        """Return the episode's goal; the instruction is ignored."""
        return env.episode.goal
