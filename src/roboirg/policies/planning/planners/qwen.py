"""QwenVL-style planning: one question per chunk, with the history of subgoals and one picture."""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import ClassVar

from pydantic import BaseModel, ConfigDict, Field, field_validator

from roboirg.core.observations import Demonstration, Observation
from roboirg.policies.planning.model_content import ChatTurn, Clip, Part, Picture, summary
from roboirg.policies.planning.models import ModelQuery
from roboirg.policies.planning.planners.vlm_planner import (
    VLMPlanner,
    VLMPlannerOptions,
    seen,
    shown,
)
from roboirg.policies.planning.points import from_boxes, tidied, without_places

VIDEO_FRAMES = 10
"""Frames of the demonstration at most."""


class SubgoalHold(BaseModel):
    """A subgoal that is kept for a while, because the model believes in it too early.

    Attributes:
        says: regular expression for the whole subgoal, places left out.
        until: control step up to which it is kept.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    says: str
    until: int = Field(ge=0)

    @field_validator("says")
    @classmethod
    def _compiles(cls, says: str) -> str:
        try:
            re.compile(says)
        except re.error as error:
            raise ValueError(f"{says!r} is no regular expression ({error})") from error
        return says


HOLDS = (
    SubgoalHold(says="press the button", until=90),
    SubgoalHold(says="press the first button", until=100),
    SubgoalHold(says="press the second button", until=250),
)
"""MME-VLA's rules for ButtonUnmask and ButtonUnmaskSwap, by what is said: a policy does not know
its task. Only subgoals of these tasks read so."""


class QwenOptions(VLMPlannerOptions):
    """Options of the QwenVL-style planner.

    Attributes:
        video_frames: pictures of the demonstration at most.
        holds: subgoals that are kept for a while.
    """

    video_frames: int = Field(default=VIDEO_FRAMES, ge=1)
    holds: tuple[SubgoalHold, ...] = HOLDS


class QwenPlanner(VLMPlanner):
    """Asks at every chunk: demonstration, task, subgoals so far, and the newest picture.

    A single turn, made anew each time. Points come in box tokens.
    """

    kind = "qwen"
    options_type: ClassVar[type[BaseModel]] = QwenOptions

    def __init__(self, options: QwenOptions) -> None:
        super().__init__(options)
        self.options = options
        self._video: Clip | None = None
        self._history: list[str] = []

    def begin(self, demonstration: Demonstration) -> None:
        """Choose the frames of the demonstration that will be shown."""
        frames = shown(demonstration)
        self._history = []
        self._video = None
        if frames is not None:
            self._video = summary(frames, self.options.video_frames, len(frames))

    def due(self, step: int) -> bool:
        """Whether no rule keeps the last subgoal."""
        if self._subgoal is None:
            return True
        said = without_places(self._subgoal)
        return not any(
            step <= hold.until and re.fullmatch(hold.says, said) for hold in self.options.holds
        )

    def ask(self, observation: Observation, step: int) -> str | None:  # noqa: ARG002
        """The next subgoal in the model's words, with pixels."""
        query = ModelQuery(
            self.prompts.fill("system"), (ChatTurn("user", tuple(self._parts(observation))),)
        )
        answer = self._asker.ask(query, _read)
        if answer is None:
            return None
        said, subgoal = answer
        if not self._history or without_places(from_boxes(self._history[-1])) != without_places(
            subgoal
        ):
            self._history.append(said)
        return subgoal

    def _parts(self, observation: Observation) -> Iterator[Part]:
        words = self.prompts
        if self._video is not None:
            yield words.fill("video")
            yield self._video
        yield words.fill("goal", instruction=self._instruction)
        if self._history:
            told = "; ".join(f"{number}. {one}" for number, one in enumerate(self._history, 1))
            yield words.fill("history", history=told)
        else:
            yield words.fill("first")
        yield words.fill("now")
        yield Picture(seen(observation))
        yield words.fill("question", forms=self.forms(), places=self.places())


def _read(text: str) -> tuple[str, str]:
    """The model's own words in one line, for the history, and the subgoal with pixels."""
    return tidied(text), from_boxes(text)
