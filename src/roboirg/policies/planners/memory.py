"""What a planner's memory is: its options, and what every memory has."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterable, Iterator, Sequence
from typing import Any, ClassVar, Literal

from pydantic import BaseModel, ConfigDict, Field

from roboirg.core.environment_options import DemonstrationFrames
from roboirg.core.observations import Demonstration, Observation
from roboirg.policies.contract.base import SubgoalEnd
from roboirg.policies.vlm.model_content import ChatTurn, Part, summary_clip
from roboirg.policies.vlm.models import ModelQuery
from roboirg.policies.vlm.prompt_files import SHARED, Prompts, load_prompts
from roboirg.util.media import Clip, Pixels

Ends = Sequence[SubgoalEnd]
"""How subgoals ended, as far as the policy reports it."""
PLACE = "[at]"
MAX_GAP = 8
"""Largest gap between neighbors of a group, control steps (MME-VLA; a comment there says 10)."""


class MemoryOptions(BaseModel):
    """Options of what a planner remembers and shows.

    Attributes:
        remembers: ``subgoals``, ``pictures``, ``keyframes`` or ``conversation``.
        subgoals: ``grounded``, with pixels, or ``simple``.
        video_frames: maximum of demonstration frames.
        observe_every: control steps between the frames of a conversation's clips, or between the
            remembered pictures.
        recent: recent frames that are sent along with key frames, the newest included.
        stride: control steps between them.
        near: largest gap between the key frames of one event, control steps.
        most: maximum of key frames, the newest; None keeps all, like MME-VLA.
        past: maximum of remembered pictures, evenly spread.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    remembers: Literal["subgoals", "pictures", "keyframes", "conversation"] = "subgoals"
    subgoals: Literal["grounded", "simple"] = "grounded"
    video_frames: int = Field(default=10, ge=1)
    observe_every: int = Field(default=1, ge=1)
    recent: int = Field(default=8, ge=1)
    stride: int = Field(default=2, ge=1)
    near: int = Field(default=MAX_GAP, ge=0)
    most: int | None = Field(default=None, ge=1)
    past: int = Field(default=32, ge=1)


class Memory(ABC):
    """One episode as a planner remembers it.

    Args:
        options: of what is remembered.
        own: prompts.
    """

    prompts: ClassVar[str]
    """Name of its prompts."""
    options: ClassVar[tuple[str, ...]] = ("remembers", "subgoals", "video_frames")
    """Options that it reads."""
    observe_every: int | None = None
    demonstration_frames: DemonstrationFrames = "all"

    def __init__(self, options: MemoryOptions, own: Prompts) -> None:
        self.limits, self.own, self.shared = options, own, load_prompts(SHARED)
        self.video: Pixels | None = None

    def begin(self, demonstration: Demonstration) -> None:
        """Begin an episode."""
        seen = len(demonstration.get("joint_positions", ()))
        self.video = demonstration["front_rgb"] if seen else None
        self._summary: Clip | None = None

    def watch(self, observation: Observation, step: int) -> None:  # noqa: B027 - optional
        """Record an observation; called at every chunk, with or without a query."""

    @abstractmethod
    def query(self, observation: Observation, instruction: str, ends: Ends) -> ModelQuery:
        """Return the next query."""

    @abstractmethod
    def parse(self, text: str, last: str | None) -> Any:  # noqa: ANN401
        """Parse the reply to the last query, given the last subgoal.

        Raises:
            UnparsableReplyError: it holds no subgoal.
        """

    @abstractmethod
    def keep(self, answer: Any, instruction: str) -> str:  # noqa: ANN401
        """Remember a parsed reply to the last query; return its subgoal with pixels."""

    def forms(self) -> str:
        """Return the forms of subgoals, one per line."""
        text = "\n".join(f"- {form}" for form in self.shared.lines("forms"))
        return text if self.limits.subgoals == "grounded" else text.replace(f" {PLACE}", "")

    def places(self) -> str:
        """Return the prompt about points: their form, or that there are none."""
        return self.own.fill(self.limits.subgoals)

    def _video_parts(self) -> Iterator[Part]:
        if self.video is not None:
            most = self.limits.video_frames
            # Kept, so that it is encoded once.
            self._summary = self._summary or summary_clip(self.video, most, len(self.video))
            yield self.own.fill("video")
            yield self._summary

    def _goal(self, instruction: str) -> str:
        return self.own.fill("goal", instruction=instruction)

    def _single(self, parts: Iterable[Part], schema: dict[str, Any] | None = None) -> ModelQuery:
        """Return a query of one turn."""
        return ModelQuery(self.own.fill("system"), (ChatTurn("user", tuple(parts)),), schema)
