"""An oracle that does not always move the same way, for demonstrations."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from roboirg.policies.builtin.oracle_policy import OraclePolicy

if TYPE_CHECKING:
    from roboirg.envs.environment import RoboIRGEnv
    from roboirg.simulation.expert.primitives import MotionPrimitives


class VariedOraclePolicy(OraclePolicy):
    """Executes the true goal with other grasps and speeds, detours, and recoveries from a miss.

    The seed determines all of it; 0 is no exception.
    """

    def make_primitives(self, env: RoboIRGEnv) -> MotionPrimitives:
        """Return the expert that executes the stages, with its variation drawn."""
        from roboirg.simulation.expert.varied_primitives import MotionVariation, VariedPrimitives

        rng = np.random.default_rng((env.episode.seed, self.seed))
        return VariedPrimitives(env.session.world, MotionVariation.draw(rng), rng)
