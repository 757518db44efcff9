"""Gemini-style planning: one conversation with clips of the recent past, at long intervals."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from fractions import Fraction
from typing import Any, ClassVar

import numpy as np
from pydantic import BaseModel, Field

from roboirg.core.observations import Demonstration, Observation
from roboirg.policies.planners.points import parse_points, says_finished
from roboirg.policies.planners.vlm_planner import (
    VLMPlanner,
    VLMPlannerOptions,
    demonstration_pictures,
    front_picture,
)
from roboirg.policies.vlm.model_content import ChatTurn, Part
from roboirg.policies.vlm.models import ModelQuery
from roboirg.util.json_reply import UnparsableReplyError, json_object, text_of
from roboirg.util.media import VIDEO_RATE, Clip, Picture, Pixels

PERIOD = 48
"""Control steps between calls."""
FIRST_PAUSE = 75
"""Control steps before which there is no second call."""
MIN_CLIP_FRAMES = 4
"""With fewer frames only the last is sent, as a picture."""


class GeminiOptions(VLMPlannerOptions):
    """Options of the Gemini-style planner.

    Attributes:
        period: control steps between calls.
        first_pause: control steps before which there is no second call. MME-VLA has it for the
            tasks with a long first action (eight of ours, all but StopCube, VideoUnmask and
            VideoUnmaskSwap); a policy does not know its task, so it holds for all. 0 is none.
        observe_every: control steps between the frames of a clip; its duration stays the same.
    """

    period: int = Field(default=PERIOD, ge=1)
    first_pause: int = Field(default=FIRST_PAUSE, ge=0)
    observe_every: int = Field(default=1, ge=1)


class GeminiPlanner(VLMPlanner):
    """Sends the frames since the last call and asks for the next subgoal.

    Turns stay in the conversation, except for queries without a usable reply, whose frames are
    sent with the next query.
    """

    kind = "gemini"
    options_type: ClassVar[type[BaseModel]] = GeminiOptions

    def __init__(self, options: GeminiOptions, _kind: str = "") -> None:
        super().__init__(options)
        self.options = options
        self.observe_every = options.observe_every
        self.demonstration_frames = "all" if options.observe_every == 1 else options.observe_every
        self._demonstration: Pixels | None = None
        self._frames: list[Pixels] = []
        self._turns: list[ChatTurn] = []
        self._periods = 0
        self._quoted = ""

    def begin(self, demonstration: Demonstration) -> None:
        """Begin a new conversation, without frames of the last episode."""
        self._demonstration = demonstration_pictures(demonstration)
        self._frames, self._turns, self._periods = [], [], 0
        self._quoted = self._instruction

    def watch(self, observation: Observation, step: int) -> None:
        """Keep the frames since the last call."""
        frames = [front_picture(earlier) for earlier in observation.get("history", ())]
        # The last picture is in the history only if the chunk ends at a multiple of the period.
        if not frames or step % self.options.observe_every:
            frames.append(front_picture(observation))
        self._frames += frames

    def due(self, step: int) -> bool:
        """Return True at the first chunk, and at the first of each period after the pause."""
        periods = step // self.options.period
        new_period = periods > self._periods
        self._periods = periods
        if not self._turns:
            return True
        return new_period and step >= self.options.first_pause

    def ask(self, observation: Observation, step: int) -> str | None:  # noqa: ARG002
        """Return the model's subgoal with pixels; the last one if it says the task is complete."""
        first = not self._turns
        turn = ChatTurn("user", tuple(self._first_query() if first else self._next_query()))
        system = self.prompts.fill("system", forms=self.forms(), places=self.places())
        fields = ("subgoal_sequence", "subgoal") if first else ("description", "subgoal")
        query = ModelQuery(system, (*self._turns, turn), _schema(fields))
        answer = self._vlm.ask(query, _parser(self._subgoal))
        if answer is None:
            return None
        text, subgoal = answer
        self._turns += [turn, ChatTurn("model", (text,))]
        self._quoted = self._instruction
        self._frames = []
        return subgoal

    def _first_query(self) -> Iterator[Part]:
        prompts = self.prompts
        yield prompts.fill("goal", instruction=self._instruction)
        if self._demonstration is None:
            yield prompts.fill("first_picture")
            yield Picture(self._frames[-1])
        else:
            yield prompts.fill("first_video")
            yield self._clip([*self._demonstration, *self._frames])
        yield prompts.fill("first_question")

    def _next_query(self) -> Iterator[Part]:
        prompts = self.prompts
        if self._quoted != self._instruction:  # more has been said since
            yield prompts.fill("goal", instruction=self._instruction)
        if len(self._frames) < MIN_CLIP_FRAMES:
            yield prompts.fill("next_picture")
            yield Picture(self._frames[-1])
        else:
            yield prompts.fill("next_clip")
            yield self._clip(self._frames)
        yield prompts.fill("next_question")

    def _clip(self, frames: list[Pixels]) -> Clip:
        return Clip(np.stack(frames), Fraction(VIDEO_RATE, self.options.observe_every))


def _schema(fields: tuple[str, ...]) -> dict[str, Any]:
    text: dict[str, Any] = {"type": "string"}
    texts = {"type": "array", "items": text}
    return {
        "type": "object",
        "properties": {name: texts if name.endswith("sequence") else text for name in fields},
        "required": list(fields),
        "additionalProperties": False,
    }


def _parser(last: str | None) -> Callable[[str], tuple[str, str]]:
    """Return a function that parses a reply into its text and the subgoal."""

    def parse(text: str) -> tuple[str, str]:
        subgoal = parse_points(text_of(json_object(text), "subgoal"))
        if not says_finished(subgoal):
            return text, subgoal
        if last is None:
            raise UnparsableReplyError("Nothing has been done yet.")
        return text, last

    return parse
