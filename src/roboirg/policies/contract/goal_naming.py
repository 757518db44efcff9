"""The contract of namers: what was said and shown, and the goal that it means."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, NamedTuple, Protocol, Self, runtime_checkable

from roboirg.core.episode import Goal
from roboirg.core.observations import FRONT, Demonstration, Pixels

if TYPE_CHECKING:
    from roboirg.envs.environment import RoboIRGEnv


class SaidAndShown(NamedTuple):
    """What a namer gets when the command has been said.

    Attributes:
        task: name of the task.
        text: everything that was said; the command is its last sentence.
        demonstration: the video, with the frames that the namer declares as its needs.
        take_picture: draws the front camera's picture of now, (256, 256, 3).
    """

    task: str
    text: str
    demonstration: Demonstration
    take_picture: Callable[[], Pixels]

    @classmethod
    def of(cls, env: RoboIRGEnv, text: str, demonstration: Demonstration) -> Self:
        """Return what a namer gets in the episode of an environment."""
        return cls(env.episode.task, text, demonstration, lambda: env.picture(FRONT))


@runtime_checkable
class GoalNamer(Protocol):
    """Names the goal of an instruction, once in an episode.

    The attributes ``cameras`` (default: none) and ``demonstration_frames`` (``"none"``) say which
    pictures it needs. ``metadata``, ``usage()`` and ``version`` go into the records, and
    ``attach(env)`` makes it privileged. All are optional.
    """

    def name_goal(self, given: SaidAndShown) -> Goal | None:
        """Return the goal, perhaps one that the scene does not have; None if it names none."""
