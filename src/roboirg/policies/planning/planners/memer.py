"""MemER-style planning: the model chooses which frames it will be shown again."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import Any, ClassVar, NamedTuple

from pydantic import BaseModel, Field

from roboirg.core.observations import Demonstration, Observation
from roboirg.policies.planning.keyframes import NEAR, merged
from roboirg.policies.planning.model_content import ChatTurn, Clip, Part, Picture, Pixels, summary
from roboirg.policies.planning.models import ModelQuery
from roboirg.policies.planning.planners.qwen import VIDEO_FRAMES
from roboirg.policies.planning.planners.vlm_planner import (
    VLMPlanner,
    VLMPlannerOptions,
    seen,
    shown,
)
from roboirg.policies.planning.points import from_boxes
from roboirg.policies.planning.vlm_query import UnparsableReply, json_object, text_of

RECENT = 8
STRIDE = 2


class MemerOptions(VLMPlannerOptions):
    """Options of the planner with a memory of key frames.

    Attributes:
        recent: frames before now that are shown, the newest included.
        stride: control steps between them.
        near: control steps by which frames of one event are apart at most.
        most: key frames that are kept at most, the newest; None keeps all, as MME-VLA does.
        video_frames: pictures of the demonstration at most.
    """

    recent: int = Field(default=RECENT, ge=1)
    stride: int = Field(default=STRIDE, ge=1)
    near: int = Field(default=NEAR, ge=0)
    most: int | None = Field(default=None, ge=1)
    video_frames: int = Field(default=VIDEO_FRAMES, ge=1)


class KeyframeChoice(NamedTuple):
    """What the model answered: a subgoal, and positions of recent frames, from 1."""

    subgoal: str
    positions: tuple[int, ...]


class MemerPlanner(VLMPlanner):
    """Asks at every chunk, with the key frames so far and the recent frames.

    Attributes:
        memory: key frames by the control step at which they were taken.
    """

    kind = "memer"
    options_type: ClassVar[type[BaseModel]] = MemerOptions

    def __init__(self, options: MemerOptions) -> None:
        super().__init__(options)
        self.options = options
        self.observe_every = options.stride
        self.memory: dict[int, Pixels] = {}
        self._video: Clip | None = None
        self._recent: dict[int, Pixels] = {}
        self._looked = 0

    def begin(self, demonstration: Demonstration) -> None:
        """An empty memory."""
        frames = shown(demonstration)
        self._video = None
        if frames is not None:
            self._video = summary(frames, self.options.video_frames, len(frames))
        self.memory, self._recent, self._looked = {}, {}, 0

    def watch(self, observation: Observation, step: int) -> None:
        """Keep the frames that may be shown: the newest, and those at the stride before it."""
        for look in observation.get("history", ()):
            self._looked += self.options.stride
            self._recent[self._looked] = look["front_rgb"].copy()
        self._recent[step] = seen(observation)
        newest = [step - back * self.options.stride for back in range(self.options.recent)]
        # At an odd step the frames just before are not at the stride; the nearest ones are.
        kept = {near for one in newest if (near := self._at(one)) is not None}
        self._recent = {at: self._recent[at] for at in sorted(kept)}

    def ask(self, observation: Observation, step: int) -> str | None:  # noqa: ARG002
        """The subgoal in the model's words, with pixels; the memory grows by what it chose."""
        steps = tuple(self._recent)
        query = ModelQuery(
            self.prompts.fill("system"),
            (ChatTurn("user", tuple(self._parts())),),
            _schema(len(steps)),
        )
        choice = self._asker.ask(query, _reader(len(steps)))
        if choice is None:
            return None
        self._remember(steps[position - 1] for position in choice.positions)
        return choice.subgoal

    def _at(self, step: int) -> int | None:
        return max((at for at in self._recent if at <= step), default=None)

    def _remember(self, chosen: Iterator[int]) -> None:
        frames = self.memory | {step: self._recent[step] for step in chosen}
        steps: Sequence[int] = merged(frames, self.options.near)
        if self.options.most is not None:
            steps = steps[-self.options.most :]
        self.memory = {step: frames[step] for step in steps}

    def _parts(self) -> Iterator[Part]:
        words = self.prompts
        if self._video is not None:
            yield words.fill("video")
            yield self._video
        yield words.fill("goal", instruction=self._instruction)
        for name, frames in (("remembered", self.memory), ("recent", self._recent)):
            yield words.fill(f"{name}_begin")
            yield from (Picture(frame) for frame in frames.values())
            yield words.fill(f"{name}_end")
        count = str(len(self._recent))
        yield words.fill("question", count=count, forms=self.forms(), places=self.places())


def _schema(count: int) -> dict[str, Any]:
    position = {"type": "integer", "enum": list(range(1, count + 1))}
    return {
        "type": "object",
        "properties": {
            "current_subtask": {"type": "string"},
            "keyframe_positions": {"type": "array", "items": position},
        },
        "required": ["current_subtask", "keyframe_positions"],
        "additionalProperties": False,
    }


def _reader(count: int) -> Callable[[str], KeyframeChoice]:
    """What reads a reply to a question with so many recent frames."""

    def read(text: str) -> KeyframeChoice:
        reply = json_object(text)
        subgoal = from_boxes(text_of(reply, "current_subtask"))
        positions = reply.get("keyframe_positions")
        if not isinstance(positions, list):
            raise UnparsableReply("The field 'keyframe_positions' has to be a list of numbers.")
        if any(type(one) is not int or not 1 <= one <= count for one in positions):
            raise UnparsableReply(f"Positions of frames are whole numbers from 1 to {count}.")
        return KeyframeChoice(subgoal, tuple(positions))

    return read
