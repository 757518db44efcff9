"""The four planners that query a model: what each remembers of an episode, and what it asks.

See `VLMPlanner` for when their methods are called.
"""

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
"""With fewer frames a turn of a conversation gets only the last one, as a picture."""
MAX_GAP = 8
"""Largest gap between neighbors of a group, control steps (MME-VLA; a comment there says 10)."""


class QwenOptions(PlannerOptions):
    """Options of the planner in QwenVL's style.

    Attributes:
        video_frames: maximum of demonstration frames.
    """

    video_frames: int = Field(default=10, ge=1)


class QwenPlanner(VLMPlanner[QwenOptions]):
    """Remembers the subgoals that it named: QwenVL-style. Points come in box tokens.

    The subgoals in `holds` are kept up to a control step, as the model tends to consider them
    reached too early. They are MME-VLA's rules for ButtonUnmask and ButtonUnmaskSwap, by the text
    of the subgoal, as a policy does not know its task. Only these tasks have such subgoals.
    """

    options_type = QwenOptions
    holds: ClassVar[Mapping[str, int]] = {
        "press the button": 90,
        "press the first button": 100,
        "press the second button": 250,
    }

    def forget(self) -> None:
        """Forget the subgoals, which are kept as the model has written them."""
        self._history: list[str] = []

    def make_query(self, observation: Observation) -> ModelQuery:
        """Return a query in one turn: demonstration, instruction, past subgoals, newest picture."""
        said = self.fill("first")
        if self._history:
            # Such as "1. press the button; 2. pick up the red cube at <|box_start|>…".
            past = [f"{number}. {subgoal}" for number, subgoal in enumerate(self._history, 1)]
            said = self.fill("history", history="; ".join(past))
        parts = [
            *self.video_parts(self.options.video_frames),
            self.instruction_prompt(),
            said,
            self.fill("now"),
            Picture(front_picture(observation)),
            self.fill("question", **self.subgoal_prompts()),
        ]
        return self.single_turn_query(parts)

    def read_reply(self, text: str) -> str:
        """Return the subgoal in a reply; add it to the history unless it repeats the last one.

        The same words with another point are the same subgoal.
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

    MME-VLA has the first pause for the tasks with a long first action (eight of ours, all but
    StopCube, VideoUnmask and VideoUnmaskSwap); a policy does not know its task, so all have it.

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
        self._frames: list[Pixels] = []  # since the last turn
        self._turns: list[ChatTurn] = []  # with usable replies, each followed by its reply
        self._quoted = ""  # the instruction as far as the conversation has quoted it

    def watch(self, observation: Observation, step: int) -> None:
        """Keep the front camera's frames since the last call, the newest one included."""
        frames = [front_picture(earlier) for earlier in observation.get("history", ())]
        # The last picture is in the history only if the chunk ends at a multiple of the period.
        if not frames or step % self.options.observe_every:
            frames.append(front_picture(observation))
        self._frames += frames

    def make_query(self, observation: Observation) -> ModelQuery:
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
        system = self.fill("system", **self.subgoal_prompts())
        return ModelQuery(system, (*self._turns, self._turn), object_schema(fields))

    def read_reply(self, text: str) -> str:
        """Return the subgoal in a reply; keep the turn and the reply in the conversation.

        If the model says that all is done, it is the last subgoal again.
        """
        subgoal = parse_points(text_of(json_object(text), "subgoal"))
        if self.says_complete(subgoal):
            subgoal = str(self.subgoal)
        self._turns += [self._turn, ChatTurn("model", (text,))]
        self._quoted = self.instruction
        self._frames = []
        return subgoal

    def _parts(self) -> Iterator[Part]:
        """Yield the parts of a turn: the instruction if that is new, the frames, and the question.

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
            yield self.instruction_prompt()
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
        recent: number of recent frames that are sent along with key frames, the newest included.
        observe_every: control steps between recent frames.
        near: largest gap between neighboring key frames of one event, control steps; of these, one
            is kept.
        most: maximum of key frames, of which the newest are kept; None keeps all, like MME-VLA.
    """

    video_frames: int = Field(default=10, ge=1)
    recent: int = Field(default=8, ge=1)
    observe_every: int = Field(default=2, ge=1)
    near: int = Field(default=MAX_GAP, ge=0)
    most: int | None = Field(default=None, ge=1)


class MemerPlanner(VLMPlanner[MemerOptions]):
    """Remembers the frames that the model chooses among the recent ones: MemER-style.

    Attributes:
        frames: the chosen ones, called key frames, by control step.
    """

    options_type = MemerOptions

    def forget(self) -> None:
        """Forget key frames and recent frames."""
        self.frames: dict[int, Pixels] = {}
        self._recent: dict[int, Pixels] = {}
        self._last_step = 0

    def watch(self, observation: Observation, step: int) -> None:
        """Keep the recent frames: the newest, and the one of each period before it.

        With a period of 16 steps and three frames, at step 50 these are of the steps 50, 34 and 18,
        or where there is no frame of a step, the last one before it.
        """
        period = self.options.observe_every
        for earlier in observation.get("history", ()):
            self._last_step += period
            self._recent[self._last_step] = front_picture(earlier)
        self._recent[step] = front_picture(observation)

        kept_steps = set()
        for number in range(self.options.recent):
            wanted = step - number * period
            steps_until = [seen for seen in self._recent if seen <= wanted]
            if steps_until:
                kept_steps.add(max(steps_until))
        # Ascending, so that positions in a reply count from the oldest.
        self._recent = {kept: self._recent[kept] for kept in sorted(kept_steps)}

    def make_query(self, observation: Observation) -> ModelQuery:  # noqa: ARG002
        """Return a query with the demonstration, the task, the key frames and the recent frames."""
        position = {"type": "integer", "enum": list(range(1, len(self._recent) + 1))}
        fields = {"current_subtask": TEXT, "keyframe_positions": _list_of(position)}
        return self.single_turn_query(self._parts(), object_schema(fields))

    def read_reply(self, text: str) -> str:
        """Return the subgoal in a reply; remember the frames that the reply chooses as key frames.

        ``{"current_subtask": "press the button", "keyframe_positions": [1, 8]}`` chooses the oldest
        and the newest of eight recent frames. Of key frames near each other one is kept
        (`merge_keyframes`), and of all at most the newest ones.
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
        """Yield the parts of a query: video, instruction, key frames, recent frames, question.

        Each group of frames stands between two prompts, ``remembered_begin`` and so on.
        """
        yield from self.video_parts(self.options.video_frames)
        yield self.instruction_prompt()
        for name, frames in (("remembered", self.frames), ("recent", self._recent)):
            yield self.fill(f"{name}_begin")
            for frame in frames.values():
                yield Picture(frame)
            yield self.fill(f"{name}_end")
        yield self.fill("question", count=str(len(self._recent)), **self.subgoal_prompts())


class StatelessOptions(PlannerOptions):
    """Options of the planner that is asked when a subgoal has ended.

    Attributes:
        video_frames: maximum of demonstration frames.
        observe_every: control steps between the remembered pictures.
        past: maximum of remembered pictures in a query, evenly spread over all.
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
        """Forget the pictures of the past."""
        self._past: list[Pixels] = []

    def watch(self, observation: Observation, step: int) -> None:  # noqa: ARG002
        """Keep the front camera's pictures of the history."""
        self._past += [front_picture(earlier) for earlier in observation.get("history", ())]

    def make_query(self, observation: Observation) -> ModelQuery:
        """Return a query with task, video, ended subgoals, past pictures and the newest one."""
        return self.single_turn_query(self._parts(observation))

    def read_reply(self, text: str) -> str:
        """Return the subgoal in the last line of a reply that has words.

        `FINISHED` if it says that the task is complete.
        """
        last_line = ""
        for line in text.splitlines():
            if normalize_subgoal(line):
                last_line = line
        subgoal = parse_points(last_line)
        return FINISHED if self.says_complete(subgoal) else subgoal

    def _parts(self, observation: Observation) -> Iterator[Part]:
        """Yield the parts of a query: video, instruction, ended subgoals, past pictures, now."""
        options = self.options
        if self.video is not None:
            yield self.fill("video")
            yield from _sheets(self.video, options.video_frames, 1)
        yield self.instruction_prompt()
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
        yield self.fill("question", **self.subgoal_prompts())


def _in_words(end: SubgoalEnd) -> str:
    """Return how a subgoal ended: ``press the button: missed, it had no effect (step 40)``."""
    words = f"{end.subgoal}: {end.how}"
    if end.why:
        words += f", {end.why}"
    return f"{words} (step {end.step})"


def _sheets(frames: Pixels, most: int, every: int) -> Iterator[Picture]:
    """Yield sheets, pictures of many small frames in rows, each frame with its control step.

    Args:
        frames: uint8 (T, height, width, 3).
        most: maximum of frames on all sheets, evenly spread over all frames.
        every: control steps between two frames, and before the first.
    """
    kept = evenly_spaced(len(frames), most)  # indices
    steps = [str((index + 1) * every) for index in kept]
    for sheet in contact_sheets(frames[kept], steps):
        yield Picture(sheet)


def _list_of(item: Mapping[str, Any]) -> dict[str, Any]:
    """Return the JSON schema of a list of items with a schema."""
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
