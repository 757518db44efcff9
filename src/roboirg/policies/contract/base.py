"""The policy contract: the methods that the benchmark calls."""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal, NamedTuple, Protocol, runtime_checkable

from roboirg.core.actions import Actions
from roboirg.core.observations import Demonstration, Observation

if TYPE_CHECKING:
    from roboirg.envs.environment import RoboIRGEnv


@runtime_checkable
class Policy(Protocol):
    """Anything that turns observations into actions.

    The class attribute ``cameras`` selects the pictures of observations, for example ``()``; by
    default there are both. ``actions`` names the action space of `act`: ``"joint_angle"`` (the
    default), ``"ee_pose"``, ``"waypoint"`` or ``"choice"``.

    Pictures of the demonstration are rendered when they are read. ``demonstration_frames = 4``
    keeps every fourth, ``"none"`` none. With ``observe_every = n`` each observation has a
    ``history``: the observations after every n-th step of the last chunk, with the pictures of all
    cameras, or only of ``history_cameras``. ``depth = True`` adds depth for the same cameras and
    ``calibration = True`` their matrices, as in `roboirg.core.observations.Observation`.

    All of these are optional, and so are the following. ``version`` (text) and ``metadata``
    (JSON values by name; read after `reset`) go into the records, and so does ``subgoal`` (None or
    a text of at most 300 characters, perhaps with ``at <y, x>``; read after `act`). ``usage()`` is
    called at the end of an episode and returns its cost: ``calls``, ``input_tokens``,
    ``output_tokens``, ``cost_usd``. ``close()`` is called after that. ``deterministic = False``
    declares that equal episodes with equal seeds may differ, which `roboirg check-policy` then
    accepts. With ``grounded = True`` the environment gives the pixels of subgoals, for privileged
    policies that pass them on.

    If an instruction is delivered in turns, `reset` gets what is said first, and
    ``hear(text, step)``, if the policy has it, each later utterance before the next call of `act`;
    ``observation["instruction"]`` is what was said last.
    """

    def reset(self, instruction: str, demonstration: Demonstration) -> None:
        """Begin an episode; the instruction is complete unless it is delivered in turns."""

    def act(self, observation: Observation) -> Actions:
        """Return the next n >= 1 actions; all are executed before the next call.

        Returns:
            Shape (n, 8); (n, 7) in the spaces ee_pose and waypoint, (n, 3) in choice.
        """


@runtime_checkable
class SubgoalFollower(Policy, Protocol):
    """A policy that takes subgoals from a planner."""

    def follow(self, subgoal: str) -> None:
        """Set the subgoal, in words, perhaps with ``at <y, x>`` (pixels of the front picture).

        Called by a planner before `act`; the subgoal holds until the next call.
        """


EndKind = Literal["done", "missed", "blocked", "time-out", "refused"]


class SubgoalEnd(NamedTuple):
    """How a policy that reports it has followed a subgoal.

    Attributes:
        subgoal: as it was named.
        how: ``done``; ``missed``, nothing came of the motion; ``blocked``, the arm cannot get
            there; ``time-out``, it took too long; ``refused``, it fits nothing or several things.
        why: the reason, for all but ``done``.
        thing: name of the object that was meant.
        step: the policy's control steps until then.
    """

    subgoal: str
    how: EndKind
    why: str = ""
    thing: str | None = None
    step: int = 0


@runtime_checkable
class ReportingFollower(SubgoalFollower, Protocol):
    """A policy that says how its subgoals end; the scripted hands are one.

    Attributes:
        endings: of this episode, in order.
    """

    endings: list[SubgoalEnd]

    def settle(self) -> None:
        """Report the motion under way if it is over; called before a planner is asked."""


@runtime_checkable
class PrivilegedPolicy(Policy, Protocol):
    """A policy that reads the simulator's state; the user declares it with ``privileged:``."""

    def attach(self, env: RoboIRGEnv) -> None:
        """Receive the environment of the next episode; called before ``reset``."""


class AttachedPolicy:
    """Keeps the environment of the episode, for policies and planners that read it."""

    _env: RoboIRGEnv | None = None

    @property
    def env(self) -> RoboIRGEnv:
        """The environment of the episode."""
        if self._env is None:
            raise RuntimeError(f"{type(self).__name__} needs attach(env) before reset().")
        return self._env

    def attach(self, env: RoboIRGEnv) -> None:
        """Receive the environment of the next episode."""
        self._env = env


def close_policy(policy: object) -> None:
    """Call the ``close`` of a policy or planner, if it has one; None is allowed."""
    close = getattr(policy, "close", None)
    if callable(close):
        close()


def tell_policy(policy: object, text: str, step: int) -> None:
    """Pass an utterance on to a policy, with the control step at which it is heard.

    A policy without ``hear(text, step)`` gets it with the next observation only.
    """
    hear = getattr(policy, "hear", None)
    if callable(hear):
        hear(text, step)
