"""The four memories: what each keeps of an episode, and the queries that follow from it."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from fractions import Fraction
from typing import Any

import numpy as np

from roboirg.core.observations import Demonstration, Observation
from roboirg.core.subgoal_text import split_point
from roboirg.policies.planners.memory import MAX_GAP, Ends, Memory, MemoryOptions
from roboirg.policies.planners.points import (
    normalize_subgoal,
    parse_boxes,
    parse_points,
    says_finished,
)
from roboirg.policies.vlm.model_content import ChatTurn, Part
from roboirg.policies.vlm.models import ModelQuery
from roboirg.policies.vlm.prompt_files import Prompts
from roboirg.util.json_reply import UnparsableReplyError, json_object, text_of
from roboirg.util.media import VIDEO_RATE, Clip, Picture, Pixels, contact_sheets, evenly_spaced

FINISHED = ""
"""Stands for the answer that the task is complete."""
MIN_CLIP_FRAMES = 4
"""With fewer frames a conversation gets only the last, as a picture."""


class SubgoalMemory(Memory):
    """Remembers the subgoals that it named: QwenVL-style. Points come in box tokens."""

    prompts = "qwen"

    def begin(self, demonstration: Demonstration) -> None:
        """Begin an episode."""
        super().begin(demonstration)
        self._history: list[str] = []

    def query(self, observation: Observation, instruction: str, ends: Ends) -> ModelQuery:  # noqa: ARG002
        """Show demonstration, task, past subgoals and the newest picture."""
        history = "; ".join(f"{number}. {one}" for number, one in enumerate(self._history, 1))
        said = self.own.fill("history", history=history) if history else self.own.fill("first")
        question = self.own.fill("question", forms=self.forms(), places=self.places())
        now = (self.own.fill("now"), Picture(front_picture(observation)))
        return self._single((*self._video_parts(), self._goal(instruction), said, *now, question))

    def parse(self, text: str, last: str | None) -> tuple[str, str]:  # noqa: ARG002
        """Return the model's text in one line, for the history, and the subgoal with pixels."""
        return normalize_subgoal(text), parse_boxes(text)

    def keep(self, answer: Any, instruction: str) -> str:  # noqa: ANN401, ARG002
        """Add the subgoal to the history if its words are new."""
        text, subgoal = answer
        last = parse_boxes(self._history[-1]) if self._history else ""
        if not last or split_point(last)[0] != split_point(subgoal)[0]:
            self._history.append(text)
        return str(subgoal)


class ConversationMemory(Memory):
    """Keeps one conversation, with clips of what has happened since the last turn: Gemini-style.

    Turns stay, except for queries without a usable reply, whose frames are sent with the next.
    """

    prompts = "gemini"
    options = ("remembers", "subgoals", "observe_every")

    def __init__(self, options: MemoryOptions, own: Prompts) -> None:
        super().__init__(options, own)
        self.observe_every = options.observe_every
        self.demonstration_frames = "all" if options.observe_every == 1 else options.observe_every

    def begin(self, demonstration: Demonstration) -> None:
        """Begin a new conversation, without frames of the last episode."""
        super().begin(demonstration)
        self._frames: list[Pixels] = []
        self._turns: list[ChatTurn] = []
        self._quoted = ""

    def watch(self, observation: Observation, step: int) -> None:
        """Keep the frames since the last call."""
        frames = [front_picture(earlier) for earlier in observation.get("history", ())]
        # The last picture is in the history only if the chunk ends at a multiple of the period.
        if not frames or step % self.limits.observe_every:
            frames.append(front_picture(observation))
        self._frames += frames

    def query(self, observation: Observation, instruction: str, ends: Ends) -> ModelQuery:  # noqa: ARG002
        """Add a turn with the frames since the last one."""
        self._frames = self._frames or [front_picture(observation)]
        when, fields = "next", ("description", "subgoal")
        if not self._turns:
            when, fields = "first", ("subgoal_sequence", "subgoal")
        self._turn = ChatTurn("user", tuple(self._parts(when, instruction)))
        system = self.own.fill("system", forms=self.forms(), places=self.places())
        return ModelQuery(system, (*self._turns, self._turn), _schema(fields))

    def parse(self, text: str, last: str | None) -> tuple[str, str]:
        """Return the text and its subgoal; the last one if it says that the task is complete."""
        subgoal = parse_points(text_of(json_object(text), "subgoal"))
        return text, str(last) if _finishes(subgoal, last) else subgoal

    def keep(self, answer: Any, instruction: str) -> str:  # noqa: ANN401
        """Keep the turn and its reply."""
        text, subgoal = answer
        self._turns += [self._turn, ChatTurn("model", (text,))]
        self._quoted, self._frames = instruction, []
        return str(subgoal)

    def _parts(self, when: str, instruction: str) -> Iterator[Part]:
        frames, has_clip = self._frames, len(self._frames) >= MIN_CLIP_FRAMES
        clip = "clip"
        if when == "first":
            clip, has_clip = "video", self.video is not None
            frames = [*(() if self.video is None else self.video), *frames]
        if self._quoted != instruction:  # the first turn, or more has been said since
            yield self._goal(instruction)
        yield self.own.fill(f"{when}_{clip}" if has_clip else f"{when}_picture")
        rate = Fraction(VIDEO_RATE, self.limits.observe_every)
        yield Clip(np.stack(frames), rate) if has_clip else Picture(frames[-1])
        yield self.own.fill(f"{when}_question")


class KeyframeMemory(Memory):
    """Remembers the frames that the model chooses among the recent ones: MemER-style.

    Attributes:
        frames: the key frames by control step.
    """

    prompts = "memer"
    options = (*Memory.options, "recent", "stride", "near", "most")

    def __init__(self, options: MemoryOptions, own: Prompts) -> None:
        super().__init__(options, own)
        self.observe_every = options.stride
        self.frames: dict[int, Pixels] = {}

    def begin(self, demonstration: Demonstration) -> None:
        """Clear the memory."""
        super().begin(demonstration)
        self.frames, self._recent, self._last_step = {}, dict[int, Pixels](), 0

    def watch(self, observation: Observation, step: int) -> None:
        """Keep the frames to send: the newest, and those at multiples of the stride before it."""
        for earlier in observation.get("history", ()):
            self._last_step += self.limits.stride
            self._recent[self._last_step] = front_picture(earlier)
        self._recent[step] = front_picture(observation)
        wanted = [step - back * self.limits.stride for back in range(self.limits.recent)]
        # The history has no frames at odd distances from the newest; the nearest before serve.
        kept = {at for one in wanted if (at := self._latest_before(one)) is not None}
        self._recent = {at: self._recent[at] for at in sorted(kept)}

    def query(self, observation: Observation, instruction: str, ends: Ends) -> ModelQuery:  # noqa: ARG002
        """Show the demonstration, the task, the key frames and the recent frames."""
        count = len(self._recent)
        position = {"type": "integer", "enum": list(range(1, count + 1))}
        schema = _schema(("current_subtask",), keyframe_positions=position)
        return self._single(self._parts(instruction, str(count)), schema)

    def parse(self, text: str, last: str | None) -> tuple[str, list[int]]:  # noqa: ARG002
        """Return a subgoal, and positions of recent frames, counted from 1."""
        reply, count = json_object(text), len(self._recent)
        subgoal = parse_boxes(text_of(reply, "current_subtask"))
        positions = reply.get("keyframe_positions")
        if not isinstance(positions, list):
            raise UnparsableReplyError(
                "The field 'keyframe_positions' has to be a list of numbers."
            )
        if any(type(one) is not int or not 1 <= one <= count for one in positions):
            raise UnparsableReplyError(f"Positions of frames are whole numbers from 1 to {count}.")
        return subgoal, positions

    def keep(self, answer: Any, instruction: str) -> str:  # noqa: ANN401, ARG002
        """Add the chosen frames."""
        subgoal, positions = answer
        steps = tuple(self._recent)
        chosen = {steps[one - 1]: self._recent[steps[one - 1]] for one in positions}
        frames = self.frames | chosen
        kept: Sequence[int] = merge_keyframes(frames, self.limits.near)
        if self.limits.most is not None:
            kept = kept[-self.limits.most :]
        self.frames = {step: frames[step] for step in kept}
        return str(subgoal)

    def _latest_before(self, step: int) -> int | None:
        return max((at for at in self._recent if at <= step), default=None)

    def _parts(self, instruction: str, count: str) -> Iterator[Part]:
        yield from self._video_parts()
        yield self._goal(instruction)
        for name, frames in (("remembered", self.frames), ("recent", self._recent)):
            yield self.own.fill(f"{name}_begin")
            yield from (Picture(frame) for frame in frames.values())
            yield self.own.fill(f"{name}_end")
        yield self.own.fill("question", count=count, forms=self.forms(), places=self.places())


class PictureMemory(Memory):
    """Remembers how subgoals ended, and pictures of the past, on sheets with their steps.

    The model answers in one line; it may answer that the task is complete.
    """

    prompts = "stateless"
    options = (*Memory.options, "observe_every", "past")

    def __init__(self, options: MemoryOptions, own: Prompts) -> None:
        every = options.observe_every if "observe_every" in options.model_fields_set else 16
        super().__init__(options, own)
        self.observe_every = every

    def begin(self, demonstration: Demonstration) -> None:
        """Begin an episode."""
        super().begin(demonstration)
        self._past: list[Pixels] = []

    def watch(self, observation: Observation, step: int) -> None:  # noqa: ARG002
        """Keep the pictures of the history."""
        self._past += [front_picture(earlier) for earlier in observation.get("history", ())]

    def query(self, observation: Observation, instruction: str, ends: Ends) -> ModelQuery:
        """Show task, video, done subgoals, pictures of the past and the newest picture."""
        return self._single(self._parts(observation, instruction, ends))

    def parse(self, text: str, last: str | None) -> str:
        """Return the subgoal in the last line of the reply."""
        lines = [line for line in text.splitlines() if line.strip()]
        subgoal = parse_points(lines[-1] if lines else "")
        return FINISHED if _finishes(subgoal, last) else subgoal

    def keep(self, answer: Any, instruction: str) -> str:  # noqa: ANN401, ARG002
        """Return the subgoal; the policy reports what comes of it."""
        return str(answer)

    def _parts(self, observation: Observation, instruction: str, ends: Ends) -> Iterator[Part]:
        own, limits = self.own, self.limits
        if self.video is not None:
            yield own.fill("video")
            yield from _sheets(self.video, limits.video_frames, 1)
        yield self._goal(instruction)
        said = "\n".join(
            f"{number}. {end.subgoal}: {end.how}{f', {end.why}' if end.why else ''} "
            f"(step {end.step})"
            for number, end in enumerate(ends, 1)
        )
        yield own.fill("history", history=said) if said else own.fill("first")
        if self._past:
            yield own.fill("past")
            yield from _sheets(np.stack(self._past), limits.past, int(self.observe_every or 1))
        yield own.fill("now")
        yield Picture(front_picture(observation))
        yield own.fill("question", forms=self.forms(), places=self.places())


MEMORIES: Mapping[str, type[Memory]] = {
    "subgoals": SubgoalMemory,
    "conversation": ConversationMemory,
    "keyframes": KeyframeMemory,
    "pictures": PictureMemory,
}


def _finishes(subgoal: str, last: str | None) -> bool:
    """Return whether a subgoal says that the task is complete; not before anything was done."""
    if says_finished(subgoal) and last is None:
        raise UnparsableReplyError("Nothing has been done yet.")
    return says_finished(subgoal)


def _sheets(frames: Pixels, most: int, every: int) -> Iterator[Picture]:
    """Yield sheets of at most `most` evenly spread frames, each with its control step."""
    kept = evenly_spaced(len(frames), most)
    for sheet in contact_sheets(frames[kept], [str((place + 1) * every) for place in kept]):
        yield Picture(sheet)


def _schema(fields: tuple[str, ...], **lists: dict[str, Any]) -> dict[str, Any]:
    """Return the JSON schema of texts, lists of texts (``…_sequence``), and other lists."""
    text: dict[str, Any] = {"type": "string"}
    lists |= {name: text for name in fields if name.endswith("sequence")}
    found = {name: {"type": "array", "items": item} for name, item in lists.items()}
    order = (*fields, *(name for name in lists if name not in fields))
    return {
        "type": "object",
        "properties": {name: found.get(name, text) for name in order},
        "required": list(order),
        "additionalProperties": False,
    }


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


def front_picture(observation: Observation) -> Pixels:
    """Return a copy of the front camera's picture, as the renderer may reuse the array."""
    return observation["front_rgb"].copy()
