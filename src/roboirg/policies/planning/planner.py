"""The contract of planners: what stands in front of a policy and tells it what to do next."""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol, runtime_checkable

from roboirg.core.observations import Demonstration, Observation

if TYPE_CHECKING:
    from roboirg.envs.environment import RoboIRGEnv


@runtime_checkable
class Planner(Protocol):
    """Names the next subgoal whenever a policy is about to choose its next actions.

    The attributes ``cameras`` (by default none), ``demonstration_frames`` (none),
    ``observe_every`` and ``grounded`` say what it wants to see, ``metadata``, ``usage()``,
    ``close()`` and ``version`` what goes into the records, all as with a policy; all are optional.
    """

    def reset(self, instruction: str, demonstration: Demonstration) -> None:
        """A new episode begins."""

    def plan(self, observation: Observation, step: int) -> str | None:
        """The subgoal to pursue from now on; None for none.

        Args:
            observation: what is seen now; ``history`` with the planner's own ``observe_every``.
            step: control steps that the policy has made in this episode.
        """


@runtime_checkable
class PrivilegedPlanner(Planner, Protocol):
    """A planner that looks behind the scenes."""

    def attach(self, env: RoboIRGEnv) -> None:
        """The environment of the episode that is about to begin, called before ``reset``."""
