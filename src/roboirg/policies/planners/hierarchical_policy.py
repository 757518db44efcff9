"""A planner, which names subgoals, and a low-level policy, which follows them, as one policy."""

from __future__ import annotations

import contextlib
import functools
from collections import Counter
from dataclasses import replace
from typing import TYPE_CHECKING, Any, cast

import numpy as np

from roboirg.core.actions import Actions
from roboirg.core.errors import InvalidValueError
from roboirg.core.observations import Demonstration, Observation
from roboirg.core.policy_needs import PolicyNeeds
from roboirg.core.policy_ref import UNKNOWN_VERSION
from roboirg.core.subgoal_text import BETWEEN_VERSIONS
from roboirg.policies.contract.base import (
    Policy,
    ReportingFollower,
    SubgoalEnd,
    SubgoalFollower,
    close_policy,
    tell_policy,
)
from roboirg.policies.contract.policy_version import file_fingerprint, read_version
from roboirg.policies.planners.observation_merging import (
    DemonstrationSubset,
    select_history,
)
from roboirg.policies.planners.planner import WHEN_DONE, Planner

if TYPE_CHECKING:
    from roboirg.envs.environment import RoboIRGEnv


MOST_REFUSALS = 5
"""Refusals in a row after which a planner is asked no more in the episode."""


class PlannerParts:
    """Base class of policies that consist of a planner, and mostly of a policy that follows it.

    What all parts have, such as costs, is joined here.

    Args:
        parts: the planner, then the policy, if there is one in this process.
    """

    def __init__(self, *parts: object) -> None:
        self._all = parts

    @property
    def version(self) -> str:
        """The versions of all parts as one text; they may set them until their `reset` ends."""
        return joint_version(*self._all)

    def hear(self, text: str, step: int) -> None:
        """Pass an utterance on to all parts that remember language."""
        for part in self._all:
            tell_policy(part, text, step)

    def usage(self) -> dict[str, float]:
        """Return the costs of all parts, added up by name: ``{"calls": 3.0, ...}``."""
        total: Counter[str] = Counter()
        for part in self._all:
            if hasattr(part, "usage"):
                total.update(part.usage())
        return dict(total)

    def close(self) -> None:
        """Close all parts, the others even if closing one fails."""
        with contextlib.ExitStack() as stack:
            for part in reversed(self._all):
                stack.callback(close_policy, part)


class PlannerAndPolicy(PlannerParts):
    """Base class of a policy that hears or follows what a planner or a namer before it says.

    Args:
        planner: is asked first; its needs count as those of a planner.
        policy: acts.

    Attributes:
        needs: of both, merged; a subclass declares them, as they are or changed.
    """

    def __init__(self, planner: object, policy: object) -> None:
        super().__init__(planner, policy)
        self._planner_needs = PolicyNeeds.of_planner(planner)
        self._policy_needs = PolicyNeeds.of(policy)
        self.needs = self._policy_needs.merge(self._planner_needs)

    def _frames_for(self, needs: PolicyNeeds, demonstration: Demonstration) -> Demonstration:
        """Return the demonstration with the frames that one of the two needs."""
        available = self.needs.demonstration_frames
        return DemonstrationSubset(demonstration, available, needs.demonstration_frames)


class HierarchicalPolicy(PlannerAndPolicy):
    """Gets a subgoal from the planner before each chunk of actions, and passes it to the policy.

    The needs of both are merged: the environment shows what either needs, and each receives its
    own part. Costs are added. Together they are privileged if either is.

    If the policy reports how subgoals end, a planner that learns from it gets each end before the
    next subgoal is asked for.

    Args:
        planner: names subgoals.
        policy: follows them.
        name: of the system, for the records.

    Attributes:
        needs: of both, merged.
        subgoal: the planner's newest, for the records; None before the first.
        reports: whether the policy reports how subgoals end.
        endings: how subgoals ended, if the policy reports it.

    Raises:
        InvalidValueError: the policy has no method ``follow``, or does not report how subgoals
            end, on which the planner waits.
    """

    def __init__(self, planner: Planner, policy: Policy, name: str | None = None) -> None:
        if not isinstance(policy, SubgoalFollower):
            raise InvalidValueError(
                f"{type(policy).__name__} has no method follow(subgoal), so it cannot take "
                "subgoals from a planner."
            )
        super().__init__(planner, policy)
        self.planner = planner
        self.policy = policy
        self.name = name
        if hasattr(planner, "attach") or hasattr(policy, "attach"):
            self.attach = functools.partial(attach_parts, (planner, policy))

        self._many_steps = self.needs.action_space.takes_many_steps
        if self._many_steps and self.needs.observe_every is None:
            # Only the history shows how many control steps an action took.
            self.needs = replace(self.needs, observe_every=1)
        self.needs.declare_on(self)

        self.reports = isinstance(policy, ReportingFollower)
        if getattr(planner, "asked", None) == WHEN_DONE and not self.reports:
            raise InvalidValueError(
                f"The planner is asked {WHEN_DONE}, but {type(policy).__name__} does not report "
                "how subgoals end; set asked=each-chunk or asked='every N steps'."
            )
        planner.reports = self.reports  # type: ignore[attr-defined]

    @property
    def endings(self) -> list[SubgoalEnd]:
        """How subgoals ended in this episode; empty if the policy does not report it."""
        return self.policy.endings if isinstance(self.policy, ReportingFollower) else []

    @property
    def metadata(self) -> dict[str, Any]:
        """The metadata of both."""
        return {
            "system": self.name,
            "planner": getattr(self.planner, "metadata", {}),
            "policy": getattr(self.policy, "metadata", {}),
        }

    def reset(self, instruction: str, demonstration: Demonstration) -> None:
        """Begin an episode with both; each gets the frames of the demonstration that it needs."""
        self.subgoal: str | None = None
        self._step = 0
        """Control steps of the policy so far."""
        self._observed = 0
        """Observations in all histories so far."""
        self._rows = 0
        """Number of actions of the last chunk."""
        self._reported = 0
        """How many of `endings` the planner has got."""
        self._gave_up = False
        """Whether the planner is asked no more."""
        self.planner.reset(instruction, self._frames_for(self._planner_needs, demonstration))
        self.policy.reset(instruction, self._frames_for(self._policy_needs, demonstration))

    def act(self, observation: Observation) -> Actions:
        """Pass the planner's subgoal to the policy, and return the policy's actions.

        Each of the two sees the part of the history that it needs.
        """
        period = self.needs.observe_every  # control steps between observations of the history
        history = observation.get("history", ())
        if self._many_steps:
            # An action takes several control steps; only the history shows how many.
            steps_between = period or 1
            self._step += len(history) * steps_between
        else:
            self._step += self._rows
        select = functools.partial(select_history, observation, self._observed, period)
        self._observed += len(history)
        if not self._gave_up:
            self._pass_subgoal_on(select(self._planner_needs.observe_every))
        rows = self.policy.act(select(self._policy_needs.observe_every))
        self._rows = len(np.atleast_2d(rows))
        return rows

    def _pass_subgoal_on(self, view: Observation) -> None:
        """Ask the planner for a subgoal and pass it to the policy, again as long as it is refused.

        After `MOST_REFUSALS` in a row, the planner is not asked any more in this episode. `view` is
        the observation with the planner's part of the history.
        """
        if isinstance(self.policy, ReportingFollower):
            self.policy.settle()
        for _ in range(MOST_REFUSALS):
            self._report_endings()
            subgoal = self.planner.plan(view, self._step)
            if subgoal is None:
                return
            self.subgoal = subgoal
            self.policy.follow(subgoal)
            new_ends = self.endings[self._reported :]
            if not any(end.how == "refused" for end in new_ends):
                return
            # The next call is at the same step, and the planner has seen the history.
            view = cast("Observation", {**view, "history": ()})
        self._report_endings()
        self._gave_up = True

    def _report_endings(self) -> None:
        """Tell the planner how subgoals have ended since the last call, if it has ``learn``."""
        new_ends = self.endings[self._reported :]
        self._reported += len(new_ends)
        if hasattr(self.planner, "learn"):
            for end in new_ends:
                # Names of objects are the world's: they would do the remembering.
                self.planner.learn(end._replace(thing=None))


def attach_parts(parts: tuple[object, ...], env: RoboIRGEnv) -> None:
    """Pass the environment on to the parts that read it.

    It is not a method: a policy that holds its own method would keep the world until the next
    collection of garbage.
    """
    for part in parts:
        if hasattr(part, "attach"):
            part.attach(env)


def joint_version(*parts: object, between: str = BETWEEN_VERSIONS) -> str:
    """Return the versions of a planner and its policy as one text, in their order.

    A part without a version counts with the fingerprint of its file. `between` separates them.
    """
    versions = [read_version(part) or file_fingerprint(part) or UNKNOWN_VERSION for part in parts]
    return between.join(versions)
