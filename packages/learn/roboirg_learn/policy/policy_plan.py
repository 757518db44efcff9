"""How the body of a policy is trained, and an episode that it learns from."""

from __future__ import annotations

from typing import Any, NamedTuple

from pydantic import NonNegativeInt, PositiveInt

from roboirg.extension.episodes import Episode
from roboirg.extension.sight import ExpertRecording
from roboirg_learn.listener.reader_plan import as_plain

MEMORY_NAMES = ("none", "recurrent", "ttt", "framesamp", "subgoal", "keyframes")
"""The kinds of memory; the last two are a planner's."""
PLANNERS = ("subgoal", "keyframes")
KEYFRAME_PLANNER = "keyframes"
"""The planner that chooses what it keeps."""
HANDS = "hands"
"""The body that follows the subgoals of a planner, and remembers nothing."""


class BodyPlan(NamedTuple):
    """How the body of a policy is trained; it depends on no words.

    Attributes:
        tasks: names of tasks.
        memory: what it remembers; a name of `MEMORY_NAMES`.
        scenes: random scenes of each task in which the disturbed expert is recorded.
        drawn: those of them of which pictures are drawn, for the detector.
        detector_epochs: passes over all pictures.
        body_epochs: passes over all episodes.
        seed: of initial weights, noise and order.
    """

    tasks: tuple[str, ...]
    memory: str = "recurrent"
    scenes: PositiveInt = 300
    drawn: PositiveInt = 300
    detector_epochs: PositiveInt = 12
    body_epochs: PositiveInt = 24
    seed: NonNegativeInt = 0

    @property
    def about(self) -> dict[str, Any]:
        """All that a body depends on, as plain data."""
        return as_plain(self._asdict())

    @property
    def of_net(self) -> BodyPlan:
        """How the net that moves is trained: where there is a planner, it follows subgoals."""
        return self._replace(memory=HANDS) if self.memory in PLANNERS else self


class Recorded(NamedTuple):
    """A recorded episode with the words' view of it."""

    episode: Episode
    recording: ExpertRecording
