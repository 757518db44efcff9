"""The policy that learned to act: pictures, words and proprioception become waypoints."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, ClassVar

from roboirg.apps.learning.policy.recording import LOOK_EVERY
from roboirg.core.actions import WAYPOINT
from roboirg.core.observations import FRONT

if TYPE_CHECKING:
    from roboirg.apps.learning.policy.policy_model import PolicyModel


class LearnedPolicy:
    """Acts on what it sees, hears and remembers; it has no access to the simulator.

    It looks at every eighth control step of the video and of its own time, and at each decision.
    """

    cameras = (FRONT,)
    actions: ClassVar[str] = WAYPOINT.name
    demonstration_frames = LOOK_EVERY
    observe_every = LOOK_EVERY

    def __init__(self, path: Path, seed: int = 0) -> None:
        from roboirg.apps.learning.listener.learned_listener import check_learn_support

        check_learn_support()
        from roboirg.apps.learning.policy.policy_model import load_policy

        self.seed = seed
        self._model: PolicyModel = load_policy(path)
        self.version = self._model.version
