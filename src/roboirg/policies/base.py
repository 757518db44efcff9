"""The policy contract: what the benchmark calls and what it gets back."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from roboirg.core.observations import Demonstration, Observation

if TYPE_CHECKING:
    from roboirg.envs.environment import RoboIRGEnv


@runtime_checkable
class Policy(Protocol):
    """Anything that turns observations into actions.

    Set the class attribute ``cameras`` to the pictures that are wanted, for example ``()``;
    by default every observation holds both. Set ``actions`` to the action space that `act`
    speaks, ``"joint_angle"`` by default, ``"ee_pose"`` or ``"waypoint"``.

    Pictures of the demonstration are drawn when they are read. ``demonstration_frames = 4`` has
    only every fourth of them, ``"none"`` none. A policy that acts in chunks and wants to see what
    happened meanwhile sets ``observe_every = n``: then every observation holds ``history``,
    with the pictures of all its cameras, or only of ``history_cameras``.

    All of these are optional, and so are the following. ``version`` (text) and ``metadata``
    (JSON values by name; read after `reset`) go into the records. ``usage()`` is called when the
    episode has ended and gives what it cost: ``calls``, ``input_tokens``, ``output_tokens``,
    ``cost_usd``. ``close()`` is called after that. ``deterministic = False`` says that equal
    episodes with equal seeds may differ; `roboirg check-policy` then does not complain of it.
    ``grounded = True`` has the environment name the pixels of subgoals, for privileged policies
    that pass them on.
    """

    def reset(self, instruction: str, demonstration: Demonstration) -> None:
        """A new episode begins."""

    def act(self, observation: Observation) -> NDArray[np.floating[Any]]:
        """The next actions, n >= 1; all are executed before the next call.

        Returns:
            Shape (n, 8), or (n, 7) in the action spaces ee_pose and waypoint.
        """


@runtime_checkable
class SubgoalFollower(Policy, Protocol):
    """A policy that a planner can tell what to do next."""

    def follow(self, subgoal: str) -> None:
        """What to do next, in words, perhaps with ``at <y, x>`` (pixels of the front picture).

        Called before `act`, whenever a planner stands in front; it holds until the next call.
        """


@runtime_checkable
class PrivilegedPolicy(Policy, Protocol):
    """A policy that looks behind the scenes; it says so by having ``attach``."""

    def attach(self, env: RoboIRGEnv) -> None:
        """The environment of the episode that is about to begin, called before ``reset``."""
