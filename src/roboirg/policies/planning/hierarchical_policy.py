"""A planner in front of a policy: together they are a policy."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from roboirg.core.actions import WAYPOINT
from roboirg.core.errors import InvalidValueError
from roboirg.core.observations import Demonstration, DemonstrationFrames, Observation
from roboirg.policies.base import Policy, SubgoalFollower
from roboirg.policies.planning.observation_merging import (
    DemonstrationSubset,
    both_cameras,
    both_frames,
    both_histories,
    cut_history,
)
from roboirg.policies.planning.planner import Planner
from roboirg.policies.requirements import (
    wanted_actions,
    wanted_cameras,
    wanted_demonstration_frames,
    wanted_history,
    wanted_history_cameras,
)

if TYPE_CHECKING:
    from roboirg.envs.environment import RoboIRGEnv


class HierarchicalPolicy:
    """Asks the planner before each of the policy's chunks and tells the policy what to do next.

    Wishes of both are met: the environment shows what either wants, and each gets to see its own
    part. Costs are added up.

    Args:
        planner: names subgoals.
        policy: follows them.
        name: of the whole, for the records.

    Raises:
        InvalidValueError: the policy has no method ``follow``.
    """

    def __init__(self, planner: Planner, policy: Policy, name: str | None = None) -> None:

        if not isinstance(policy, SubgoalFollower):
            raise InvalidValueError(
                f"{type(policy).__name__} has no method follow(subgoal), so a planner cannot "
                "stand in front of it."
            )
        self.planner, self.policy, self.name = planner, policy, name
        self.actions = wanted_actions(policy).name
        self.cameras = both_cameras(wanted_cameras(policy), _cameras(planner))
        self._frames = _frames(planner), wanted_demonstration_frames(policy)
        self.demonstration_frames: DemonstrationFrames = both_frames(*self._frames)
        self._looks = _observe_every(planner), wanted_history(policy)
        self.observe_every = both_histories(*self._looks)
        recalled = wanted_history_cameras(policy)
        self.history_cameras = both_cameras(
            wanted_cameras(policy) if recalled is None else recalled, _cameras(planner)
        )
        if self.actions == WAYPOINT.name and self.observe_every is None:
            # Only what is seen tells how many control steps a way point took.
            self.observe_every = 1
        self.grounded = any(getattr(one, "grounded", False) for one in (planner, policy))
        self._looked = self._step = self._rows = 0

    @property
    def version(self) -> str:
        """Of both."""
        versions = (getattr(one, "version", "unknown") for one in (self.planner, self.policy))
        return " + ".join(str(version) for version in versions)

    @property
    def metadata(self) -> dict[str, Any]:
        """What both say of themselves."""
        return {
            "system": self.name,
            "planner": dict(getattr(self.planner, "metadata", {})),
            "policy": dict(getattr(self.policy, "metadata", {})),
        }

    def reset(self, instruction: str, demonstration: Demonstration) -> None:
        """A new episode begins for both."""
        self._looked = self._step = self._rows = 0
        views = [
            DemonstrationSubset(demonstration, self.demonstration_frames, one)
            for one in self._frames
        ]
        self.planner.reset(instruction, views[0])
        self.policy.reset(instruction, views[1])

    def act(self, observation: Observation) -> NDArray[np.floating[Any]]:
        """Ask the planner, tell the policy, and let it act."""
        history = observation.get("history", ())
        # Other than in way points, a row is a control step.
        self._step += (
            len(history) * (self.observe_every or 1)
            if self.actions == WAYPOINT.name
            else self._rows
        )
        views = [
            cut_history(observation, self._looked, self.observe_every, wanted)
            for wanted in self._looks
        ]
        self._looked += len(history)
        subgoal = self.planner.plan(views[0], self._step)
        if subgoal is not None and isinstance(self.policy, SubgoalFollower):
            self.policy.follow(subgoal)
        rows = self.policy.act(views[1])
        self._rows = len(np.atleast_2d(rows))
        return rows

    def usage(self) -> dict[str, float]:
        """What both cost."""
        total: dict[str, float] = {}
        for one in (self.planner, self.policy):
            usage = one.usage() if hasattr(one, "usage") else {}
            for name, value in usage.items():
                total[name] = total.get(name, 0) + value
        return total

    def close(self) -> None:
        """Close both, the second even if the first cannot be closed."""
        try:
            _close(self.planner)
        finally:
            _close(self.policy)


class PrivilegedHierarchicalPolicy(HierarchicalPolicy):
    """A planner and a policy of which at least one looks behind the scenes."""

    def attach(self, env: RoboIRGEnv) -> None:
        """Hand the environment on."""
        for one in (self.planner, self.policy):
            if hasattr(one, "attach"):
                one.attach(env)


def with_planner(planner: Planner, policy: Policy, name: str | None = None) -> HierarchicalPolicy:
    """Planner and policy as one policy, which is privileged if either is.

    Raises:
        InvalidValueError: the policy has no method ``follow``.
    """
    privileged = any(hasattr(one, "attach") for one in (planner, policy))
    kind = PrivilegedHierarchicalPolicy if privileged else HierarchicalPolicy
    return kind(planner, policy, name)


def _cameras(planner: Planner) -> tuple[str, ...]:
    return tuple(getattr(planner, "cameras", ()))


def _frames(planner: Planner) -> DemonstrationFrames:
    wish: DemonstrationFrames = getattr(planner, "demonstration_frames", "none")
    return wish


def _observe_every(planner: Planner) -> int | None:
    wish: int | None = getattr(planner, "observe_every", None)
    return wish


def _close(one: object) -> None:
    close = getattr(one, "close", None)
    if close is not None:
        close()
