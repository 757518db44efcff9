"""How a policy is trained, and an episode that it learns from."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

from pydantic import NonNegativeInt, PositiveInt

from roboirg.extension.episodes import Episode, plain_settings
from roboirg.extension.sight import ExpertRecording
from roboirg_learn.listener.vocabulary import USUAL_ENCODERS, WordPool

MEMORY_NAMES = ("none", "recurrent", "ttt", "framesamp", "subgoal", "keyframes")
"""The kinds of memory; the last two are a planner's."""
PLANNERS = ("subgoal", "keyframes")
CHOOSES = "keyframes"
"""The planner that chooses what it keeps."""
HANDS = "hands"
"""The body that follows the subgoals of a planner, and remembers nothing."""
WORDLESS = "none"
"""Words of a policy that is trained without any."""


class PolicyPlan(NamedTuple):
    """How a policy is trained.

    Attributes:
        tasks: names of tasks.
        language: version of the words.
        settings: names of settings whose instructions it hears; none for a policy without words.
        words: the pool of words.
        memory: what it remembers; a name of `MEMORY_NAMES`.
        scenes: random scenes of each task in which the disturbed expert is recorded.
        drawn: those of them of which pictures are drawn, for the detector.
        goals: goals of each scene that the reader of words hears in implicit settings.
        detector_epochs: passes over all pictures.
        body_epochs: passes over all episodes.
        reader_epochs: passes over all instructions.
        seed: of initial weights, noise and order.
        encoders: the settings of each encoder of the reader.
    """

    tasks: tuple[str, ...]
    language: int
    settings: tuple[str, ...] = ("explicit",)
    words: WordPool = "train"
    memory: str = "recurrent"
    scenes: PositiveInt = 300
    drawn: PositiveInt = 300
    goals: PositiveInt = 4
    detector_epochs: PositiveInt = 12
    body_epochs: PositiveInt = 24
    reader_epochs: PositiveInt = 12
    seed: NonNegativeInt = 0
    encoders: Mapping[str, dict[str, Any]] = USUAL_ENCODERS

    @property
    def heard(self) -> str:
        """Which settings it hears, for names of files."""
        if set(self.settings) == set(plain_settings()):
            return "all"
        return "-".join(self.settings) or WORDLESS

    @property
    def name(self) -> str:
        """What distinguishes it from others in the same folder: memory, words and seed."""
        return f"{self.memory}-{self.heard}-{self.seed}"


class Recorded(NamedTuple):
    """A recorded episode with the words' view of it."""

    episode: Episode
    recording: ExpertRecording
