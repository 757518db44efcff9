"""The four planners that query a model: what each keeps of an episode, and what it asks."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from fractions import Fraction
from typing import Any, ClassVar

import numpy as np
from pydantic import Field

from roboirg.core.observations import Observation, Pixels
from roboirg.core.subgoal_text import split_point
from roboirg.policies.contract.base import SubgoalEnd
from roboirg.policies.planners.planner import WHEN_DONE
from roboirg.policies.planners.points import normalize_subgoal, parse_points
from roboirg.policies.planners.query_schedule import Asked
from roboirg.policies.planners.vlm_planner import FINISHED, PlannerOptions, VLMPlanner
from roboirg.policies.vlm.goal_schema import object_schema
from roboirg.policies.vlm.model_content import ChatTurn, Part
from roboirg.policies.vlm.models import ModelQuery
from roboirg.util.media import VIDEO_RATE, Clip, Picture, contact_sheets, evenly_spaced
from roboirg.util.reply_reading import UnparsableReplyError, json_object, text_of, whole_number

TEXT: Mapping[str, Any] = {"type": "string"}
"""Schema of a field with words."""
MIN_CLIP_FRAMES = 4
"""With fewer frames a conversation gets only the last, as a picture."""
MAX_GAP = 8
"""Largest gap between neighbors of a group, control steps (MME-VLA; a comment there says 10)."""


class QwenOptions(PlannerOptions):
    """Options of the planner in QwenVL's style.

    Attributes:
        video_frames: maximum of demonstration frames.
    """

    video_frames: int = Field(default=10, ge=1)


class QwenPlanner(VLMPlanner[QwenOptions]):
    """Remembers the subgoals that it named: QwenVL-style. Points come in box tokens."""

    options_type = QwenOptions
    holds: ClassVar[Mapping[str, int]] = {
        "press the button": 90,
        "press the first button": 100,
        "press the second button": 250,
    }
    """The model tends to consider these reached too early: MME-VLA's rules for ButtonUnmask and
    ButtonUnmaskSwap, by the text of the subgoal, as a policy does not know its task. Only these
    tasks have such subgoals."""

    def forget(self) -> None:
        """Forget the subgoals."""
        self._history: list[str] = []

    def query(self, observation: Observation) -> ModelQuery:
        """Return a query with demonstration, task, past subgoals and the newest picture."""
        said = self.fill("first")
        if self._history:
            # Such as "1. press the button; 2. pick up the red cube at <|box_start|>…".
            past = [f"{number}. {subgoal}" for number, subgoal in enumerate(self._history, 1)]
            said = self.fill("history", history="; ".join(past))
        parts = [
            *self.video_parts(self.options.video_frames),
            self.goal(),
            said,
            self.fill("now"),
            Picture(front_picture(observation)),
            self.fill("question", **self.forms()),
        ]
        return self.single(parts)

    def take(self, text: str) -> str:
        """Return the subgoal in a reply; add it to the history unless it repeats the last one.

        Points do not count: the same words with another point are the same subgoal.
        """
        subgoal = parse_points(text)
        words, _ = split_point(subgoal)
        last_words = None
        if self._history:
            last_words, _ = split_point(parse_points(self._history[-1]))
        if words != last_words:
            self._history.append(normalize_subgoal(text))
        return subgoal


class GeminiOptions(PlannerOptions):
    """Options of the planner in Gemini's style.

    MME-VLA has the pause for the tasks with a long first action (eight of ours, all but StopCube,
    VideoUnmask and VideoUnmaskSwap); a policy does not know its task, so it holds for all.

    Attributes:
        observe_every: control steps between the frames of clips.
    """

    asked: Asked = "every 48 steps"
    first_pause: int = Field(default=75, ge=0)
    observe_every: int = Field(default=1, ge=1)


class GeminiPlanner(VLMPlanner[GeminiOptions]):
    """Keeps one conversation, with clips of what has happened since the last turn: Gemini-style.

    Turns stay, except for queries without a usable reply, whose frames are sent with the next.
    """

    options_type = GeminiOptions

    def __init__(self, options: GeminiOptions, kind: str, seed: int = 0) -> None:
        super().__init__(options, kind, seed)
        self.demonstration_frames = "all" if options.observe_every == 1 else options.observe_every

    def forget(self) -> None:
        """Begin a new conversation, without frames of the last episode."""
        self._frames: list[Pixels] = []
        self._turns: list[ChatTurn] = []
        self._quoted = ""

    def watch(self, observation: Observation, step: int) -> None:
        """Keep the frames since the last call."""
        frames = [front_picture(earlier) for earlier in observation.get("history", ())]
        # The last picture is in the history only if the chunk ends at a multiple of the period.
        if not frames or step % self.options.observe_every:
            frames.append(front_picture(observation))
        self._frames += frames

    def query(self, observation: Observation) -> ModelQuery:
        """Return a query with one more turn, which has the frames since the last turn.

        Only in the first turn the model has to list all subgoals (``subgoal_sequence``).
        """
        if not self._frames:
            self._frames = [front_picture(observation)]
        if self._turns:
            fields = {"description": TEXT, "subgoal": TEXT}
        else:
            fields = {"subgoal_sequence": _list_of(TEXT), "subgoal": TEXT}
        self._turn = ChatTurn("user", tuple(self._parts()))
        system = self.fill("system", **self.forms())
        return ModelQuery(system, (*self._turns, self._turn), object_schema(fields))

    def take(self, text: str) -> str:
        """Return the subgoal, the last one if all is done; keep the turn and its reply."""
        subgoal = parse_points(text_of(json_object(text), "subgoal"))
        if self.finishes(subgoal):
            subgoal = str(self.subgoal)
        self._turns += [self._turn, ChatTurn("model", (text,))]
        self._quoted = self.instruction
        self._frames = []
        return subgoal

    def _parts(self) -> Iterator[Part]:
        """Yield the parts of a turn: what is said if that is new, the frames, and the question.

        The first turn shows the demonstration as a clip, with the first frame at its end. A later
        turn shows a clip if there are enough frames, else only the newest frame as a picture.
        """
        frames = self._frames
        if self._turns:
            when = "next"
            clip_prompt = "next_clip"
            has_clip = len(frames) >= MIN_CLIP_FRAMES
        else:
            when = "first"
            clip_prompt = "first_video"
            has_clip = self.video is not None
            if self.video is not None:
                frames = [*self.video, *frames]
        if self._quoted != self.instruction:  # the first turn, or more has been said since
            yield self.goal()
        if has_clip:
            yield self.fill(clip_prompt)
            yield Clip(np.stack(frames), Fraction(VIDEO_RATE, self.options.observe_every))
        else:
            yield self.fill(f"{when}_picture")
            yield Picture(frames[-1])
        yield self.fill(f"{when}_question")


class MemerOptions(PlannerOptions):
    """Options of the planner in MemER's style.

    Attributes:
        video_frames: maximum of demonstration frames.
        recent: recent frames that are sent along with key frames, the newest included.
        observe_every: control steps between them.
        near: largest gap between the key frames of one event, control steps.
        most: maximum of key frames, the newest; None keeps all, like MME-VLA.
    """

    video_frames: int = Field(default=10, ge=1)
    recent: int = Field(default=8, ge=1)
    observe_every: int = Field(default=2, ge=1)
    near: int = Field(default=MAX_GAP, ge=0)
    most: int | None = Field(default=None, ge=1)


class MemerPlanner(VLMPlanner[MemerOptions]):
    """Remembers the frames that the model chooses among the recent ones: MemER-style.

    Attributes:
        frames: the key frames by control step.
    """

    options_type = MemerOptions

    def forget(self) -> None:
        """Clear the memory."""
        self.frames: dict[int, Pixels] = {}
        self._recent: dict[int, Pixels] = {}
        self._last_step = 0

    def watch(self, observation: Observation, step: int) -> None:
        """Keep the frames to send: the newest, and the one of each period before it.

        With a period of 16 steps and three frames, at step 50 these are of the steps 50, 34 and 18,
        or where there is no frame of a step, the last one before it.
        """
        every = self.options.observe_every
        for earlier in observation.get("history", ()):
            self._last_step += every
            self._recent[self._last_step] = front_picture(earlier)
        self._recent[step] = front_picture(observation)

        kept: set[int] = set()
        for periods in range(self.options.recent):
            latest = step - periods * every
            steps_until = [kept_step for kept_step in self._recent if kept_step <= latest]
            if steps_until:
                kept.add(max(steps_until))
        self._recent = {kept_step: self._recent[kept_step] for kept_step in sorted(kept)}

    def query(self, observation: Observation) -> ModelQuery:  # noqa: ARG002
        """Show the demonstration, the task, the key frames and the recent frames."""
        position = {"type": "integer", "enum": list(range(1, len(self._recent) + 1))}
        fields = {"current_subtask": TEXT, "keyframe_positions": _list_of(position)}
        return self.single(self._parts(), object_schema(fields))

    def take(self, text: str) -> str:
        """Return the subgoal in a reply; remember the frames that it chooses.

        It names positions in the recent frames, from 1 on. Of frames near each other one is kept,
        and of all at most the newest `most`.
        """
        reply = json_object(text)
        subgoal = parse_points(text_of(reply, "current_subtask"))
        positions = reply.get("keyframe_positions")
        if not isinstance(positions, list):
            raise UnparsableReplyError(
                "The field 'keyframe_positions' has to be a list of numbers."
            )
        steps = tuple(self._recent)
        frames = dict(self.frames)
        for given in positions:
            position = whole_number(given)
            if position is None or not 1 <= position <= len(steps):
                raise UnparsableReplyError(
                    f"Positions of frames are whole numbers from 1 to {len(steps)}."
                )
            step = steps[position - 1]
            frames[step] = self._recent[step]
        kept = merge_keyframes(frames, self.options.near)
        if self.options.most is not None:
            kept = kept[-self.options.most :]
        self.frames = {step: frames[step] for step in kept}
        return subgoal

    def _parts(self) -> Iterator[Part]:
        """Yield the parts of a query: video, what was said, key frames, recent frames, question."""
        yield from self.video_parts(self.options.video_frames)
        yield self.goal()
        for name, frames in (("remembered", self.frames), ("recent", self._recent)):
            yield self.fill(f"{name}_begin")
            for frame in frames.values():
                yield Picture(frame)
            yield self.fill(f"{name}_end")
        yield self.fill("question", count=str(len(self._recent)), **self.forms())


class StatelessOptions(PlannerOptions):
    """Options of the planner that is asked when a subgoal has ended.

    Attributes:
        video_frames: maximum of demonstration frames.
        observe_every: control steps between the remembered pictures.
        past: maximum of remembered pictures, evenly spread.
    """

    asked: Asked = WHEN_DONE
    video_frames: int = Field(default=10, ge=1)
    observe_every: int = Field(default=16, ge=1)
    past: int = Field(default=32, ge=1)


class StatelessPlanner(VLMPlanner[StatelessOptions]):
    """Remembers how subgoals ended, and pictures of the past, on sheets with their steps.

    The model answers in one line; it may answer that the task is complete.
    """

    options_type = StatelessOptions

    def forget(self) -> None:
        """Forget the pictures."""
        self._past: list[Pixels] = []

    def watch(self, observation: Observation, step: int) -> None:  # noqa: ARG002
        """Keep the pictures of the history."""
        self._past += [front_picture(earlier) for earlier in observation.get("history", ())]

    def query(self, observation: Observation) -> ModelQuery:
        """Show task, video, done subgoals, pictures of the past and the newest picture."""
        return self.single(self._parts(observation))

    def take(self, text: str) -> str:
        """Return the subgoal in the last line with words of a reply; `FINISHED` at the end."""
        last_line = ""
        for line in text.splitlines():
            if normalize_subgoal(line):
                last_line = line
        subgoal = parse_points(last_line)
        return FINISHED if self.finishes(subgoal) else subgoal

    def _parts(self, observation: Observation) -> Iterator[Part]:
        """Yield the parts of a query: video, what was said, how subgoals ended, past, now."""
        options = self.options
        if self.video is not None:
            yield self.fill("video")
            yield from _sheets(self.video, options.video_frames, 1)
        yield self.goal()
        if self.ends:
            lines = [f"{number}. {_in_words(end)}" for number, end in enumerate(self.ends, 1)]
            yield self.fill("history", history="\n".join(lines))
        else:
            yield self.fill("first")
        if self._past:
            yield self.fill("past")
            yield from _sheets(np.stack(self._past), options.past, options.observe_every)
        yield self.fill("now")
        yield Picture(front_picture(observation))
        yield self.fill("question", **self.forms())


def _in_words(end: SubgoalEnd) -> str:
    """Return how a subgoal ended: ``press the button: missed, it had no effect (step 40)``."""
    words = f"{end.subgoal}: {end.how}"
    if end.why:
        words += f", {end.why}"
    return f"{words} (step {end.step})"


def _sheets(frames: Pixels, most: int, every: int) -> Iterator[Picture]:
    """Yield sheets of at most `most` evenly spread frames, each with its control step.

    Args:
        frames: uint8 (T, height, width, 3).
        most: maximum of frames on all sheets.
        every: control steps between two frames, and before the first.
    """
    kept = evenly_spaced(len(frames), most)
    steps = [str((place + 1) * every) for place in kept]
    for sheet in contact_sheets(frames[kept], steps):
        yield Picture(sheet)


def _list_of(item: Mapping[str, Any]) -> dict[str, Any]:
    return {"type": "array", "items": item}


def merge_keyframes(steps: Iterable[int], near: int = MAX_GAP) -> tuple[int, ...]:
    """Replace each group of near steps by its middle one; of two middle ones, by the later.

    With `near` 5, the steps 1, 4, 7, 20 become 4, 20: each of the first three is near the next.

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


def front_picture(observation: Observation) -> Pixels:
    """Return a copy of the front camera's picture, as the renderer may reuse the array."""
    return observation["front_rgb"].copy()
