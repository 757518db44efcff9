"""Who moves the robot in a trajectory."""

from __future__ import annotations

from roboirg.apps.demonstrations.export_plan import ORACLE, RecordingJob
from roboirg.core.errors import MotionPlanningError
from roboirg.envs.factory import make
from roboirg.policies import Policy, make_policy, play
from roboirg.policies.builtin.oracle_policy import VariedOraclePolicy
from roboirg.policies.builtin.waypoint_expert import (
    Disturbance,
    JointWaypointExpert,
    WaypointExpert,
)

MAX_DRAWS = 20
"""Seeds to try for a variation that succeeds."""


def choose_policy(job: RecordingJob) -> Policy:
    """Return the policy of a trajectory: for a variation, one that succeeds if any does.

    A disturbed one is not chosen by its success: others would show less of how to recover.
    """
    disturbance = Disturbance() if job.spec.disturbed else None
    if job.policy == ORACLE and job.spec.actions == WaypointExpert.actions:
        return WaypointExpert(job.variation, disturbance)
    if disturbance is not None:
        return JointWaypointExpert(job.variation, disturbance)
    if job.policy != ORACLE or job.variation == 0:
        return make_policy(job.policy, 0)
    return VariedOraclePolicy(find_variation(job))


def find_variation(job: RecordingJob) -> int:
    """Return the seed of a variation that succeeds, found by playing without pictures.

    If none of those tried does, returns the last.
    """
    seeds = range(job.variation * MAX_DRAWS, (job.variation + 1) * MAX_DRAWS)
    for seed in seeds:
        env = make(job.episode, cameras=())
        try:
            if play(env, VariedOraclePolicy(seed))["status"] == "success":
                return seed
        except MotionPlanningError:
            continue
        finally:
            env.close()
    return seeds[-1]
