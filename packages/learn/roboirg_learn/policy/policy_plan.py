"""How the body of a policy is trained, and an episode that it learns from."""

from __future__ import annotations

from typing import Any, NamedTuple

from pydantic import NonNegativeInt, PositiveInt

from roboirg.extension.episodes import Episode
from roboirg.extension.sight import ExpertRecording
from roboirg_learn.listener.reader_plan import as_plain

MEMORY_NAMES = ("none", "recurrent", "ttt", "framesamp", "subgoal", "keyframes")
"""Values of ``--memory``: the kinds of memory; the last two are a planner's."""
PLANNERS = ("subgoal", "keyframes")
"""Those with a planner: a network that names subgoals, which another one, the hands, follows."""
KEYFRAME_PLANNER = "keyframes"
"""The planner that chooses the looks that it keeps."""
HANDS = "hands"
"""In the place of a memory for the network that follows a planner's subgoals; it remembers
nothing."""


class BodyPlan(NamedTuple):
    """How the body of a policy is trained; it depends on no words.

    Attributes:
        tasks: names of tasks.
        memory: what it remembers; a name of `MEMORY_NAMES`.
        scenes: how many random scenes of each task the disturbed expert is recorded in.
        drawn: of how many of them pictures are rendered, for the detector.
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
        """All that a body depends on, as plain JSON data; stands in trained files and records."""
        return as_plain(self._asdict())

    @property
    def of_net(self) -> BodyPlan:
        """The plan of the network that chooses moves: with a planner it becomes the hands."""
        if self.memory in PLANNERS:
            return self._replace(memory=HANDS)
        return self


class Recorded(NamedTuple):
    """An episode (scene, goal, stages) and the expert's recording of it."""

    episode: Episode
    recording: ExpertRecording
