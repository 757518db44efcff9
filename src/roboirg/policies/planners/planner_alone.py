"""A planner as a policy, whose hands are in another process."""

from __future__ import annotations

from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from roboirg.core.observations import Demonstration, Observation
from roboirg.core.policy_needs import PolicyNeeds
from roboirg.policies.contract.base import SubgoalEnd, close_policy, tell_policy
from roboirg.policies.planners.hierarchical_policy import joint_version
from roboirg.policies.planners.planner import Planner


class PlannerAlone:
    """Names subgoals and does nothing; its process holds no world.

    Args:
        planner: gets how subgoals ended (``ends``) and the ``step`` from observations.

    Attributes:
        subgoal: the newest.
    """

    def __init__(self, planner: Planner) -> None:
        self.planner: Any = planner
        planner.reports = True  # type: ignore[attr-defined]
        PolicyNeeds.of_planner(planner).declare_on(self)
        self.subgoal: str | None = None

    @property
    def version(self) -> str:
        """The planner's, which it may set until its `reset` ends."""
        return joint_version(self.planner)

    @property
    def metadata(self) -> Any:  # noqa: ANN401 - of any class
        """The planner's."""
        return getattr(self.planner, "metadata", {})

    def reset(self, instruction: str, demonstration: Demonstration) -> None:
        """Begin an episode."""
        self.subgoal = None
        self.planner.reset(instruction, demonstration)

    def hear(self, text: str, step: int) -> None:
        """Pass on what was said."""
        tell_policy(self.planner, [{"text": text, "step": step}])

    def act(self, observation: Observation) -> NDArray[np.float64]:
        """Let the planner name a subgoal; the action means nothing."""
        seen: dict[str, Any] = dict(observation)
        ends, step = seen.pop("ends"), seen.pop("step")
        for end in ends if hasattr(self.planner, "learn") else ():
            self.planner.learn(SubgoalEnd(*end))
        self.subgoal = self.planner.plan(cast("Observation", seen), step)
        return np.zeros((1, 8))

    def usage(self) -> dict[str, float]:
        """Return the planner's cost."""
        return dict(self.planner.usage()) if hasattr(self.planner, "usage") else {}

    def close(self) -> None:
        """Close the planner."""
        close_policy(self.planner)
