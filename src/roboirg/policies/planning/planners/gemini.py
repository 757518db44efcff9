"""Gemini-style planning: a conversation, clips of what happened, a call now and then."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from fractions import Fraction
from typing import Any, ClassVar

import numpy as np
from pydantic import BaseModel, Field

from roboirg.core.observations import Demonstration, Observation
from roboirg.policies.planning.model_content import (
    VIDEO_RATE,
    ChatTurn,
    Clip,
    Part,
    Picture,
    Pixels,
)
from roboirg.policies.planning.models import ModelQuery
from roboirg.policies.planning.planners.vlm_planner import (
    VLMPlanner,
    VLMPlannerOptions,
    seen,
    shown,
)
from roboirg.policies.planning.points import from_points, says_finished
from roboirg.policies.planning.vlm_query import UnparsableReply, json_object, text_of

PERIOD = 48
"""Control steps between calls."""
FIRST_PAUSE = 75
"""Control steps before which there is no second call."""
FEWEST_FRAMES = 4
"""Of fewer frames only the last is shown, as a picture."""


class GeminiOptions(VLMPlannerOptions):
    """Options of the Gemini-style planner.

    Attributes:
        period: control steps between calls.
        first_pause: control steps before which there is no second call. MME-VLA has it for the
            tasks with a long first action (eight of ours, all but StopCube, VideoUnmask and
            VideoUnmaskSwap); a policy does not know its task, so it holds for all. 0 is none.
        observe_every: control steps between the frames of a clip; clips last as long either way.
    """

    period: int = Field(default=PERIOD, ge=1)
    first_pause: int = Field(default=FIRST_PAUSE, ge=0)
    observe_every: int = Field(default=1, ge=1)


class GeminiPlanner(VLMPlanner):
    """Shows what happened since the last call and asks for the subgoal to pursue.

    What is said stays in the conversation; a question without a usable answer leaves it, and its
    frames are shown with the next one.
    """

    kind = "gemini"
    options_type: ClassVar[type[BaseModel]] = GeminiOptions

    def __init__(self, options: GeminiOptions) -> None:
        super().__init__(options)
        self.options = options
        self.observe_every = options.observe_every
        self.demonstration_frames = "all" if options.observe_every == 1 else options.observe_every
        self._demonstration: Pixels | None = None
        self._frames: list[Pixels] = []
        self._said: list[ChatTurn] = []
        self._passed = 0

    def begin(self, demonstration: Demonstration) -> None:
        """A new conversation; no frame of the last episode is left in it."""
        self._demonstration = shown(demonstration)
        self._frames, self._said, self._passed = [], [], 0

    def watch(self, observation: Observation, step: int) -> None:
        """Keep the frames since the last call."""
        looks = [look["front_rgb"].copy() for look in observation.get("history", ())]
        # Where the chunk's end was not a moment to look at, now is seen besides.
        if not looks or step % self.options.observe_every:
            looks.append(seen(observation))
        self._frames += looks

    def due(self, step: int) -> bool:
        """At the first chunk, and at the first one of each further period after the pause."""
        periods = step // self.options.period
        fresh = periods > self._passed
        self._passed = periods
        if not self._said:
            return True
        return fresh and step >= self.options.first_pause

    def ask(self, observation: Observation, step: int) -> str | None:  # noqa: ARG002
        """What the model says, with pixels; the last subgoal if it says that all is done."""
        first = not self._said
        turn = ChatTurn("user", tuple(self._first() if first else self._next()))
        system = self.prompts.fill("system", forms=self.forms(), places=self.places())
        fields = ("subgoal_sequence", "subgoal") if first else ("description", "subgoal")
        query = ModelQuery(system, (*self._said, turn), _schema(fields))
        answer = self._asker.ask(query, _reader(self._subgoal))
        if answer is None:
            return None
        text, subgoal = answer
        self._said += [turn, ChatTurn("model", (text,))]
        self._frames = []
        return subgoal

    def _first(self) -> Iterator[Part]:
        words = self.prompts
        yield words.fill("goal", instruction=self._instruction)
        if self._demonstration is None:
            yield words.fill("first_picture")
            yield Picture(self._frames[-1])
        else:
            yield words.fill("first_video")
            yield self._clip([*self._demonstration, *self._frames])
        yield words.fill("first_question")

    def _next(self) -> Iterator[Part]:
        words = self.prompts
        if len(self._frames) < FEWEST_FRAMES:
            yield words.fill("next_picture")
            yield Picture(self._frames[-1])
        else:
            yield words.fill("next_clip")
            yield self._clip(self._frames)
        yield words.fill("next_question")

    def _clip(self, frames: list[Pixels]) -> Clip:
        return Clip(np.stack(frames), Fraction(VIDEO_RATE, self.options.observe_every))


def _schema(fields: tuple[str, ...]) -> dict[str, Any]:
    words: dict[str, Any] = {"type": "string"}
    several = {"type": "array", "items": words}
    return {
        "type": "object",
        "properties": {name: several if name.endswith("sequence") else words for name in fields},
        "required": list(fields),
        "additionalProperties": False,
    }


def _reader(last: str | None) -> Callable[[str], tuple[str, str]]:
    """What reads a reply: its text, for the conversation, and the subgoal."""

    def read(text: str) -> tuple[str, str]:
        subgoal = from_points(text_of(json_object(text), "subgoal"))
        if not says_finished(subgoal):
            return text, subgoal
        if last is None:
            raise UnparsableReply("Nothing has been done yet.")
        return text, last

    return read
