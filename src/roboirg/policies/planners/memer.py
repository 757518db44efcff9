"""MemER-style planning: the model chooses the frames to keep in its memory."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import Any, ClassVar, NamedTuple

from pydantic import BaseModel, Field

from roboirg.core.observations import Demonstration, Observation
from roboirg.policies.planners.points import parse_boxes
from roboirg.policies.planners.qwen import VIDEO_FRAMES
from roboirg.policies.planners.vlm_planner import (
    VLMPlanner,
    VLMPlannerOptions,
    demonstration_pictures,
    front_picture,
)
from roboirg.policies.vlm.model_content import ChatTurn, Part, summary_clip
from roboirg.policies.vlm.models import ModelQuery
from roboirg.util.json_reply import UnparsableReplyError, json_object, text_of
from roboirg.util.media import Clip, Picture, Pixels

RECENT = 8
STRIDE = 2
MAX_GAP = 8
"""Largest gap between neighbors of a group, control steps (MME-VLA; a comment there says 10)."""


class MemerOptions(VLMPlannerOptions):
    """Options of the planner with a memory of key frames.

    Attributes:
        recent: recent frames that are sent, the newest included.
        stride: control steps between them.
        near: largest gap between the key frames of one event, control steps.
        most: maximum of key frames, the newest; None keeps all, like MME-VLA.
        video_frames: maximum of demonstration frames.
    """

    recent: int = Field(default=RECENT, ge=1)
    stride: int = Field(default=STRIDE, ge=1)
    near: int = Field(default=MAX_GAP, ge=0)
    most: int | None = Field(default=None, ge=1)
    video_frames: int = Field(default=VIDEO_FRAMES, ge=1)


class KeyframeChoice(NamedTuple):
    """The model's reply: a subgoal, and positions of recent frames, counted from 1."""

    subgoal: str
    positions: tuple[int, ...]


class MemerPlanner(VLMPlanner):
    """Queries the model at every chunk, with its key frames and the recent frames.

    Attributes:
        memory: key frames by control step.
    """

    kind = "memer"
    options_type: ClassVar[type[BaseModel]] = MemerOptions

    def __init__(self, options: MemerOptions, _kind: str = "") -> None:
        super().__init__(options)
        self.options = options
        self.observe_every = options.stride
        self.memory: dict[int, Pixels] = {}
        self._video: Clip | None = None
        self._recent: dict[int, Pixels] = {}
        self._last_step = 0

    def begin(self, demonstration: Demonstration) -> None:
        """Clear the memory, and choose the frames of the demonstration to send."""
        frames = demonstration_pictures(demonstration)
        self._video = None
        if frames is not None:
            self._video = summary_clip(frames, self.options.video_frames, len(frames))
        self.memory, self._recent, self._last_step = {}, {}, 0

    def watch(self, observation: Observation, step: int) -> None:
        """Keep the frames to send: the newest, and those at multiples of the stride before it."""
        for earlier in observation.get("history", ()):
            self._last_step += self.options.stride
            self._recent[self._last_step] = front_picture(earlier)
        self._recent[step] = front_picture(observation)
        wanted = [step - back * self.options.stride for back in range(self.options.recent)]
        # The history has no frames at odd distances from the newest; the nearest before serve.
        kept = {at for one in wanted if (at := self._latest_before(one)) is not None}
        self._recent = {at: self._recent[at] for at in sorted(kept)}

    def ask(self, observation: Observation, step: int) -> str | None:  # noqa: ARG002
        """Return the model's subgoal with pixels, and add the frames it chose to the memory."""
        steps = tuple(self._recent)
        query = ModelQuery(
            self.prompts.fill("system"),
            (ChatTurn("user", tuple(self._parts())),),
            _schema(len(steps)),
        )
        choice = self._vlm.ask(query, _parser(len(steps)))
        if choice is None:
            return None
        self._remember(steps[position - 1] for position in choice.positions)
        return choice.subgoal

    def _latest_before(self, step: int) -> int | None:
        return max((at for at in self._recent if at <= step), default=None)

    def _remember(self, chosen: Iterator[int]) -> None:
        frames = self.memory | {step: self._recent[step] for step in chosen}
        steps: Sequence[int] = merge_keyframes(frames, self.options.near)
        if self.options.most is not None:
            steps = steps[-self.options.most :]
        self.memory = {step: frames[step] for step in steps}

    def _parts(self) -> Iterator[Part]:
        prompts = self.prompts
        if self._video is not None:
            yield prompts.fill("video")
            yield self._video
        yield prompts.fill("goal", instruction=self._instruction)
        for name, frames in (("remembered", self.memory), ("recent", self._recent)):
            yield prompts.fill(f"{name}_begin")
            yield from (Picture(frame) for frame in frames.values())
            yield prompts.fill(f"{name}_end")
        count = str(len(self._recent))
        yield prompts.fill("question", count=count, forms=self.forms(), places=self.places())


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


def _parser(count: int) -> Callable[[str], KeyframeChoice]:
    """Return a function that parses the reply to a query with `count` recent frames."""

    def parse(text: str) -> KeyframeChoice:
        reply = json_object(text)
        subgoal = parse_boxes(text_of(reply, "current_subtask"))
        positions = reply.get("keyframe_positions")
        if not isinstance(positions, list):
            raise UnparsableReplyError(
                "The field 'keyframe_positions' has to be a list of numbers."
            )
        if any(type(one) is not int or not 1 <= one <= count for one in positions):
            raise UnparsableReplyError(f"Positions of frames are whole numbers from 1 to {count}.")
        return KeyframeChoice(subgoal, tuple(positions))

    return parse


def merge_keyframes(steps: Iterable[int], near: int = MAX_GAP) -> tuple[int, ...]:
    """Replace each group of near steps by its middle one, of two the later.

    Args:
        steps: of the frames, in any order, possibly repeated.
        near: largest gap between neighbors of a group.

    Returns:
        Some of `steps`, ascending.
    """
    groups: list[list[int]] = []
    for step in sorted(set(steps)):
        if groups and step - groups[-1][-1] <= near:
            groups[-1].append(step)
        else:
            groups.append([step])
    return tuple(group[len(group) // 2] for group in groups)
