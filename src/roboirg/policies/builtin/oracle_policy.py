"""The oracle, which knows the goal and the poses of all objects; and one that varies its motion."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from roboirg.core.episode import Goal
from roboirg.policies.builtin.scripted import WORDLESS, ScriptedPolicy

if TYPE_CHECKING:
    from roboirg.envs.environment import RoboIRGEnv
    from roboirg.simulation.expert.primitives import MotionPrimitives


class OraclePolicy(ScriptedPolicy):
    """Executes the true goal: the upper bound, and the proof that an episode can be solved."""

    listens: ClassVar[bool] = False
    metadata: ClassVar[Mapping[str, str]] = WORDLESS

    def decide(self, env: RoboIRGEnv, instruction: str) -> Goal | None:  # noqa: ARG002
        """Return the episode's goal; the instruction is ignored."""
        return env.episode.goal


class VariedOraclePolicy(OraclePolicy):
    """Executes the true goal with other grasps and speeds, detours, and recoveries from a miss.

    The seed determines all of it; 0 is no exception.
    """

    def make_primitives(self, env: RoboIRGEnv) -> MotionPrimitives:
        """Return the expert that executes the stages, with its variation drawn."""
        from roboirg.simulation.expert.varied_primitives import MotionVariation, VariedPrimitives

        rng = np.random.default_rng((env.episode.seed, self.seed))
        return VariedPrimitives(env.session.world, MotionVariation.draw(rng), rng)
