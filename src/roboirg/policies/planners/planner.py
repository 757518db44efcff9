"""The contract of planners, which give subgoals to a low-level policy."""

from __future__ import annotations

from typing import Literal, Protocol, runtime_checkable

from pydantic import BaseModel, ConfigDict

from roboirg.core.observations import Demonstration, Observation

EACH_CHUNK, WHEN_DONE = "each-chunk", "when-done"
"""When a planner is asked: before each chunk of actions, or when a subgoal has ended or something
was said. The third is ``every N steps``."""


class SubgoalOptions(BaseModel):
    """Options of every planner of ours.

    Attributes:
        subgoals: ``grounded``, with the pixel of the object, ``pick up the cube at <120, 87>``, or
            ``simple``, ``pick up the cube``.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    subgoals: Literal["grounded", "simple"] = "grounded"


@runtime_checkable
class Planner(Protocol):
    """Names the next subgoal before each chunk of a policy.

    As for policies, the attributes ``cameras`` (default: none), ``demonstration_frames``
    (``"none"``), ``observe_every`` and ``grounded`` are its needs, ``metadata``, ``usage()``
    and ``version`` go into the records, ``close()`` ends an episode, and ``attach(env)`` makes it
    privileged, and ``hear(text, step)`` gets what is said after `reset`. ``reports`` is set to
    whether the policy reports how subgoals end, which a planner whose ``asked`` is ``when-done``
    needs; ``learn(end)`` then gets each `roboirg.policies.contract.base.SubgoalEnd` before the next
    call of `plan`. After a refusal `plan` is called again at the same step, with an empty history.
    All are optional.
    """

    def reset(self, instruction: str, demonstration: Demonstration) -> None:
        """Begin an episode."""

    def plan(self, observation: Observation, step: int) -> str | None:
        """Return the subgoal from now on, such as ``pick up the red cube``; None for none.

        Args:
            observation: now; its ``history`` follows the planner's own ``observe_every``.
            step: control steps of the policy in this episode so far.
        """
