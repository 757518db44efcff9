"""A planner and a low-level policy as one policy."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from roboirg.core.actions import WAYPOINT
from roboirg.core.errors import InvalidValueError
from roboirg.core.observations import Demonstration, DemonstrationFrames, Observation
from roboirg.policies.contract.base import Policy, SubgoalFollower, close_policy, tell_policy
from roboirg.policies.contract.requirements import (
    wanted_actions,
    wanted_calibration,
    wanted_cameras,
    wanted_demonstration_frames,
    wanted_depth,
    wanted_history,
    wanted_history_cameras,
    wanted_lower_case,
    wanted_prompt_added,
    wanted_prompt_tokens,
    wanted_tokenizer,
)
from roboirg.policies.planners.observation_merging import (
    DemonstrationSubset,
    merge_cameras,
    merge_demonstration_frames,
    merge_observe_every,
    select_history,
)
from roboirg.policies.planners.planner import Planner

if TYPE_CHECKING:
    from roboirg.envs.environment import RoboIRGEnv


class HierarchicalPolicy:
    """Gets a subgoal from the planner before each chunk and passes it to the policy.

    The requirements of both are merged: the environment shows what either wants, and each
    receives its own part. Costs are added.

    Args:
        planner: names subgoals.
        policy: follows them.
        name: of the system, for the records.

    Raises:
        InvalidValueError: the policy has no method ``follow``.
    """

    def __init__(self, planner: Planner, policy: Policy, name: str | None = None) -> None:
        if not isinstance(policy, SubgoalFollower):
            raise InvalidValueError(
                f"{type(policy).__name__} has no method follow(subgoal), so it cannot take "
                "subgoals from a planner."
            )
        self.planner, self.policy, self.name = planner, policy, name
        self.actions = wanted_actions(policy).name
        self.cameras = merge_cameras(wanted_cameras(policy), _cameras(planner))
        self._frames = _frames(planner), wanted_demonstration_frames(policy)
        self.demonstration_frames: DemonstrationFrames = merge_demonstration_frames(*self._frames)
        self._periods = _observe_every(planner), wanted_history(policy)
        self.observe_every = merge_observe_every(*self._periods)
        history_cameras = wanted_history_cameras(policy)
        self.history_cameras = merge_cameras(
            wanted_cameras(policy) if history_cameras is None else history_cameras,
            _cameras(planner),
        )
        if self.actions == WAYPOINT.name and self.observe_every is None:
            # Only the history tells how many control steps a waypoint took.
            self.observe_every = 1
        self.depth = wanted_depth(policy) or wanted_depth(planner)
        self.calibration = wanted_calibration(policy) or wanted_calibration(planner)
        # The planner's model has a context of its own, which no instruction fills.
        self.prompt_tokens, self.prompt_added = (
            wanted_prompt_tokens(policy),
            wanted_prompt_added(policy),
        )
        self.tokenizer, self.lowers_prompt = wanted_tokenizer(policy), wanted_lower_case(policy)
        self.grounded = any(getattr(one, "grounded", False) for one in (planner, policy))
        self._observed = self._step = self._rows = 0

    @property
    def version(self) -> str:
        """The versions of both."""
        versions = (getattr(one, "version", "unknown") for one in (self.planner, self.policy))
        return " + ".join(str(version) for version in versions)

    @property
    def metadata(self) -> dict[str, Any]:
        """The metadata of both."""
        return {
            "system": self.name,
            "planner": dict(getattr(self.planner, "metadata", {})),
            "policy": dict(getattr(self.policy, "metadata", {})),
        }

    def reset(self, instruction: str, demonstration: Demonstration) -> None:
        """Begin an episode with both."""
        self._observed = self._step = self._rows = 0
        views = [
            DemonstrationSubset(demonstration, self.demonstration_frames, one)
            for one in self._frames
        ]
        self.planner.reset(instruction, views[0])
        self.policy.reset(instruction, views[1])

    def hear(self, text: str, step: int) -> None:
        """Pass an utterance on to both, as far as they remember language."""
        for one in (self.planner, self.policy):
            tell_policy(one, [{"text": text, "step": step}])

    def act(self, observation: Observation) -> NDArray[np.floating[Any]]:
        """Pass the planner's subgoal to the policy, and return the policy's actions."""
        history = observation.get("history", ())
        # Except for waypoints, a row is a control step.
        self._step += (
            len(history) * (self.observe_every or 1)
            if self.actions == WAYPOINT.name
            else self._rows
        )
        views = [
            select_history(observation, self._observed, self.observe_every, wanted)
            for wanted in self._periods
        ]
        self._observed += len(history)
        subgoal = self.planner.plan(views[0], self._step)
        if subgoal is not None and isinstance(self.policy, SubgoalFollower):
            self.policy.follow(subgoal)
        rows = self.policy.act(views[1])
        self._rows = len(np.atleast_2d(rows))
        return rows

    def usage(self) -> dict[str, float]:
        """Return the cost of both."""
        total: dict[str, float] = {}
        for one in (self.planner, self.policy):
            usage = one.usage() if hasattr(one, "usage") else {}
            for name, value in usage.items():
                total[name] = total.get(name, 0) + value
        return total

    def close(self) -> None:
        """Close both, the second even if closing the first fails."""
        try:
            close_policy(self.planner)
        finally:
            close_policy(self.policy)


class PrivilegedHierarchicalPolicy(HierarchicalPolicy):
    """A planner and a policy of which at least one is privileged."""

    def attach(self, env: RoboIRGEnv) -> None:
        """Pass the environment on."""
        for one in (self.planner, self.policy):
            if hasattr(one, "attach"):
                one.attach(env)


def with_planner(planner: Planner, policy: Policy, name: str | None = None) -> HierarchicalPolicy:
    """Join a planner and a policy; the result is privileged if either is.

    Raises:
        InvalidValueError: the policy has no method ``follow``.
    """
    privileged = any(hasattr(one, "attach") for one in (planner, policy))
    kind = PrivilegedHierarchicalPolicy if privileged else HierarchicalPolicy
    return kind(planner, policy, name)


def _cameras(planner: Planner) -> tuple[str, ...]:
    return tuple(getattr(planner, "cameras", ()))


def _frames(planner: Planner) -> DemonstrationFrames:
    frames: DemonstrationFrames = getattr(planner, "demonstration_frames", "none")
    return frames


def _observe_every(planner: Planner) -> int | None:
    every: int | None = getattr(planner, "observe_every", None)
    return every
