"""The policy that learned to act: pictures, words and proprioception become waypoints."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from roboirg.extension.policies import Demonstration, Observation
from roboirg.extension.sight import LOOK_EVERY

if TYPE_CHECKING:
    from roboirg_learn.policy.policy_model import PolicyModel, SeenEpisode


class LearnedPolicy:
    """Acts on what it sees, hears and remembers; it has no access to the simulator.

    It looks at every eighth control step of the video and of its own time, and at each decision.
    Each action is a waypoint, which the environment reaches in many control steps.

    Args:
        model: what it has learned.
        seed: without effect, as nothing is random.

    Attributes:
        seen: the episode as it was seen so far; there is one after `reset`.
    """

    seen: SeenEpisode
    cameras = ("front",)
    actions: ClassVar[str] = "waypoint"
    demonstration_frames = LOOK_EVERY
    observe_every = LOOK_EVERY

    def __init__(self, model: PolicyModel, seed: int = 0) -> None:
        self.seed = seed
        self.version = model.version
        self.model = model
        self.trained_tasks = tuple(model.reader.plan["tasks"])
        self._heard: list[str] = []
        self._goal: NDArray[np.float32] | None = None

    @property
    def metadata(self) -> dict[str, Any]:
        """How its body and its reader were trained."""
        return {"trained": {"body": self.model.body.plan, "reader": self.model.reader.plan}}

    def reset(self, instruction: str, demonstration: Demonstration) -> None:
        """Begin an episode: hear the instruction, and look at every eighth step of the video."""
        from roboirg_learn.policy.policy_model import SeenEpisode

        self._heard = [instruction]
        self._goal = None
        self.seen = SeenEpisode(self.model)
        if len(demonstration["joint_positions"]):
            poses = demonstration["end_effector"][::LOOK_EVERY]
            openings = demonstration["gripper"][::LOOK_EVERY, 0]
            tools = np.column_stack([poses, openings])
            self.seen.look(list(demonstration["front_rgb"]), list(tools), is_video=True)

    def hear(self, text: str, step: int) -> None:  # noqa: ARG002
        """Hear another utterance; the goal is understood anew."""
        self._heard.append(text)
        self._goal = None

    def act(self, observation: Observation) -> NDArray[np.float64]:
        """Return the next waypoint (1, 7), in an array of one row, as `moves.waypoint` makes it."""
        seen = self.watch(observation)
        return seen.decide(self.understand(), tool_of(observation))[None]

    def understand(self) -> NDArray[np.float32]:
        """Return the goal that was heard, as `GoalLayout.encode` does; kept until more is heard."""
        if self._goal is None:
            self._goal = self.seen.understand(" ".join(self._heard))
        return self._goal

    def watch(self, observation: Observation) -> SeenEpisode:
        """Look at what was observed since the last action, and now; return the episode so far.

        The last look of the history may be the observation itself, which is not seen twice.
        """
        looks: list[Mapping[str, Any]] = list(observation.get("history", ()))
        if not looks or not _is_same_moment(looks[-1], observation):
            looks.append(observation)
        pictures = [look["front_rgb"] for look in looks]
        self.seen.look(pictures, [tool_of(look) for look in looks], is_video=False)
        return self.seen


def tool_of(observation: Mapping[str, Any]) -> NDArray[np.float64]:
    """Return x, y, z, m, roll, pitch, yaw, rad, of the tool, and one finger's opening, m: (7,)."""
    return np.append(observation["end_effector"], observation["gripper"][0])


def _is_same_moment(first: Mapping[str, Any], second: Mapping[str, Any]) -> bool:
    """Return whether two observations are of the same moment.

    A robot that waits stands still, so that the picture has to be equal, too.
    """
    names = ("joint_positions", "gripper", "front_rgb")
    return all(np.array_equal(first[name], second[name]) for name in names)
