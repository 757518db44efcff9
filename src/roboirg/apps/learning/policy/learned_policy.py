"""The policy that learned to act: pictures, words and proprioception become waypoints."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from roboirg.apps.learning.learn_support import check_learn_support, file_version
from roboirg.apps.learning.policy.recording import LOOK_EVERY
from roboirg.core.actions import WAYPOINT
from roboirg.core.observations import FRONT, Demonstration, Observation

if TYPE_CHECKING:
    from roboirg.apps.learning.policy.policy_model import SeenEpisode


class LearnedPolicy:
    """Acts on what it sees, hears and remembers; it has no access to the simulator.

    It looks at every eighth control step of the video and of its own time, and at each decision.

    Args:
        path: file that `roboirg learn policy` wrote.
        seed: without effect, as nothing is random.
    """

    cameras = (FRONT,)
    actions: ClassVar[str] = WAYPOINT.name
    demonstration_frames = LOOK_EVERY
    observe_every = LOOK_EVERY

    def __init__(self, path: Path, seed: int = 0) -> None:
        check_learn_support()
        from roboirg.apps.learning.policy.policy_model import load_policy

        self.seed, self.version = seed, file_version(path, "policy")
        self._model = load_policy(path)
        self._seen: SeenEpisode | None = None
        self._heard: list[str] = []
        self._goal: NDArray[np.float32] | None = None

    @property
    def metadata(self) -> dict[str, Any]:
        """How it was trained."""
        return {"trained": self._model.about}

    def reset(self, instruction: str, demonstration: Demonstration) -> None:
        """Begin an episode, and see the video."""
        from roboirg.apps.learning.policy.policy_model import SeenEpisode

        self._heard, self._goal = [instruction], None
        self._seen = SeenEpisode(self._model)
        length = len(demonstration["joint_positions"])
        if length:
            poses, fingers = demonstration["end_effector"], demonstration["gripper"]
            tools = [
                np.append(poses[time], fingers[time][0]) for time in range(0, length, LOOK_EVERY)
            ]
            self._seen.look(list(demonstration["front_rgb"]), tools, is_video=True)

    def hear(self, text: str, step: int) -> None:  # noqa: ARG002
        """Hear another utterance; the goal is understood anew."""
        self._heard.append(text)
        self._goal = None

    def act(self, observation: Observation) -> NDArray[np.float64]:
        """Return the next waypoint (1, 7)."""
        if self._seen is None:
            raise RuntimeError("LearnedPolicy needs reset() before act().")
        self._look(self._seen, observation)
        if self._goal is None:
            self._goal = self._seen.understand(" ".join(self._heard))
        chosen = self._seen.decide(self._goal, _tool(observation))
        return np.asarray(chosen, np.float64)[None]

    def _look(self, seen: SeenEpisode, observation: Observation) -> None:
        """See what happened since the last action, and what there is now."""
        passed: Sequence[Observation] = observation.get("history", ())
        looks: list[Mapping[str, Any]] = [*passed]
        if not passed or not _same(passed[-1], observation):
            looks.append(observation)
        pictures = [one[f"{FRONT}_rgb"] for one in looks]
        seen.look(pictures, [_tool(one) for one in looks], is_video=False)


def _tool(observation: Mapping[str, Any]) -> NDArray[np.float64]:
    """Return the pose of the tool and the opening of a finger, (7,)."""
    return np.append(observation["end_effector"], observation["gripper"][0])


def _same(one: Mapping[str, Any], other: Mapping[str, Any]) -> bool:
    """Return whether two observations are of the same moment."""
    return all(np.array_equal(one[name], other[name]) for name in ("joint_positions", "gripper"))
