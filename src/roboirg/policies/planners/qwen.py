"""QwenVL-style planning: one query per chunk, with the past subgoals and one picture."""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import ClassVar

from pydantic import BaseModel, ConfigDict, Field, field_validator

from roboirg.core.observations import Demonstration, Observation
from roboirg.core.subgoal_text import split_point
from roboirg.policies.planners.points import normalize_subgoal, parse_boxes
from roboirg.policies.planners.vlm_planner import (
    VLMPlanner,
    VLMPlannerOptions,
    demonstration_pictures,
    front_picture,
)
from roboirg.policies.vlm.model_content import ChatTurn, Part, summary_clip
from roboirg.policies.vlm.models import ModelQuery
from roboirg.util.media import Clip, Picture

VIDEO_FRAMES = 10
"""Maximum of demonstration frames."""


class SubgoalHold(BaseModel):
    """A rule that keeps a subgoal which the model tends to consider reached too early.

    Attributes:
        says: regular expression for the whole subgoal without points.
        until: last control step at which it is kept.
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
            raise ValueError(f"{says!r} is not a regular expression ({error})") from error
        return says


HOLDS = (
    SubgoalHold(says="press the button", until=90),
    SubgoalHold(says="press the first button", until=100),
    SubgoalHold(says="press the second button", until=250),
)
"""MME-VLA's rules for ButtonUnmask and ButtonUnmaskSwap, by the text of the subgoal, as a policy
does not know its task. Only these tasks have such subgoals."""


class QwenOptions(VLMPlannerOptions):
    """Options of the QwenVL-style planner.

    Attributes:
        video_frames: maximum of demonstration frames.
        holds: rules that keep a subgoal.
    """

    video_frames: int = Field(default=VIDEO_FRAMES, ge=1)
    holds: tuple[SubgoalHold, ...] = HOLDS


class QwenPlanner(VLMPlanner):
    """Queries the model at every chunk: demonstration, task, past subgoals, newest picture.

    Each query is a single turn. Points come in box tokens.
    """

    kind = "qwen"
    options_type: ClassVar[type[BaseModel]] = QwenOptions

    def __init__(self, options: QwenOptions, _kind: str = "") -> None:
        super().__init__(options)
        self.options = options
        self._video: Clip | None = None
        self._history: list[str] = []

    def begin(self, demonstration: Demonstration) -> None:
        """Choose the frames of the demonstration to send."""
        frames = demonstration_pictures(demonstration)
        self._history = []
        self._video = None
        if frames is not None:
            self._video = summary_clip(frames, self.options.video_frames, len(frames))

    def due(self, step: int) -> bool:
        """Return whether no rule keeps the last subgoal."""
        if self._subgoal is None:
            return True
        text, _ = split_point(self._subgoal)
        return not any(
            step <= hold.until and re.fullmatch(hold.says, text) for hold in self.options.holds
        )

    def ask(self, observation: Observation, step: int) -> str | None:  # noqa: ARG002
        """Return the model's subgoal with pixels."""
        query = ModelQuery(
            self.prompts.fill("system"), (ChatTurn("user", tuple(self._parts(observation))),)
        )
        answer = self._vlm.ask(query, _parse)
        if answer is None:
            return None
        text, subgoal = answer
        last = parse_boxes(self._history[-1]) if self._history else ""
        if not last or split_point(last)[0] != split_point(subgoal)[0]:
            self._history.append(text)
        return subgoal

    def _parts(self, observation: Observation) -> Iterator[Part]:
        prompts = self.prompts
        if self._video is not None:
            yield prompts.fill("video")
            yield self._video
        yield prompts.fill("goal", instruction=self._instruction)
        if self._history:
            history = "; ".join(f"{number}. {one}" for number, one in enumerate(self._history, 1))
            yield prompts.fill("history", history=history)
        else:
            yield prompts.fill("first")
        yield prompts.fill("now")
        yield Picture(front_picture(observation))
        yield prompts.fill("question", forms=self.forms(), places=self.places())


def _parse(text: str) -> tuple[str, str]:
    """Return the model's text in one line, for the history, and the subgoal with pixels."""
    return normalize_subgoal(text), parse_boxes(text)
