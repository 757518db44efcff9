"""A planner alone as a policy: what follows its subgoals (its hands) is in another process."""

from __future__ import annotations

from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from roboirg.core.observations import Demonstration, Observation
from roboirg.core.policy_needs import PolicyNeeds
from roboirg.policies.contract.base import SubgoalEnd
from roboirg.policies.planners.hierarchical_policy import PlannerParts
from roboirg.policies.planners.planner import Planner

_ACTION_SIZE = 8
"""Seven joints and the gripper."""


class PlannerAlone(PlannerParts):
    """Names subgoals and does nothing; its process holds no simulator.

    The process of the hands sends observations with two more entries, ``step`` and ``ends``, and
    reads `subgoal` after each call of `act`.

    Args:
        planner: names the subgoals.

    Attributes:
        subgoal: the planner's newest; None before the first, or for none.
    """

    def __init__(self, planner: Planner) -> None:
        super().__init__(planner)
        self.planner: Any = planner
        planner.reports = True  # type: ignore[attr-defined]
        PolicyNeeds.of_planner(planner).declare_on(self)
        self.subgoal: str | None = None

    @property
    def metadata(self) -> Any:  # noqa: ANN401 - of any class
        """The planner's."""
        return getattr(self.planner, "metadata", {})

    def reset(self, instruction: str, demonstration: Demonstration) -> None:
        """Begin an episode."""
        self.subgoal = None
        self.planner.reset(instruction, demonstration)

    def act(self, observation: Observation) -> NDArray[np.float64]:
        """Let the planner name a subgoal; the returned action (1, 8) means nothing.

        The process of the hands adds two entries to the observation, which are taken out before
        the planner sees it: ``step``, the control steps so far, and ``ends``, how subgoals have
        ended since the last call, which a planner with the method ``learn`` gets.
        """
        seen: dict[str, Any] = dict(observation)
        ends = seen.pop("ends")
        step = seen.pop("step")
        if hasattr(self.planner, "learn"):
            for end in ends:
                self.planner.learn(SubgoalEnd(*end))
        self.subgoal = self.planner.plan(cast("Observation", seen), step)
        return np.zeros((1, _ACTION_SIZE))  # one row, as every policy must return one
