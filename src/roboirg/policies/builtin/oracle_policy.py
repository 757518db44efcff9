"""The oracle: knows the goal and where everything is."""

from __future__ import annotations

from typing import TYPE_CHECKING

from roboirg.core.episode import Goal
from roboirg.policies.builtin.scripted import ScriptedPolicy

if TYPE_CHECKING:
    from roboirg.envs.environment import RoboIRGEnv


class OraclePolicy(ScriptedPolicy):
    """Privileged hands and mind; the upper bound, and the proof that an episode can be solved."""

    def decide(self, env: RoboIRGEnv, instruction: str) -> Goal:  # noqa: ARG002
        """The episode's goal, whatever is said."""
        return env.episode.goal
