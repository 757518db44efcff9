"""Rehearse an episode without a world: what a planner's or a listener's model would be sent."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple, cast

import numpy as np

from roboirg.core.observations import Demonstration, Observation
from roboirg.policies.contract.base import SubgoalEnd
from roboirg.policies.planners.points import PICTURE_SIZE
from roboirg.policies.planners.vlm_planner import VLMPlanner
from roboirg.policies.vlm.goal_schema import goal_schema
from roboirg.policies.vlm.listener_query import question_texts
from roboirg.policies.vlm.model_content import ChatTurn, Part, summary_clip
from roboirg.policies.vlm.models import ModelOptions, ModelQuery, ModelReply
from roboirg.policies.vlm.vlm_listener import VLMListener
from roboirg.util.media import Clip, Picture, Pixels

LETTERS_OF_A_TOKEN = 4
PICTURE_TOKENS = 258
"""Of a picture of up to 384 x 384 pixels at Google; other models take 64 to 300 for ours."""
CHUNK = 20
"""Control steps of a chunk; scripted hands take 22 on average, the paper's policies 16."""
SUBGOAL_STEPS = 78
"""Control steps that scripted hands take for a subgoal; mean over the explicit test episodes."""
_BLANK = np.zeros((PICTURE_SIZE, PICTURE_SIZE, 3), np.uint8)


class CallSizes(NamedTuple):
    """What calls of a model add up to."""

    calls: float = 0
    input_tokens: float = 0
    output_tokens: float = 0

    def plus(self, other: CallSizes) -> CallSizes:
        """Return the sum."""
        return CallSizes(*(one + more for one, more in zip(self, other, strict=True)))


def size_of(query: ModelQuery, options: ModelOptions) -> int:
    """Return about how many tokens a query has, by the letters and pictures that are sent."""
    tokens = len(query.system) // LETTERS_OF_A_TOKEN
    for part in (part for turn in query.turns for part in turn.parts):
        if isinstance(part, Picture):
            tokens += PICTURE_TOKENS
        elif isinstance(part, Clip):
            sampled = len(part.frames) / float(part.rate) * (options.sampling_fps or 1)
            most = sampled if options.video == "mp4" else options.clip_frames
            tokens += PICTURE_TOKENS * max(round(min(len(part.frames), most)), 1)
        else:
            tokens += len(part) // LETTERS_OF_A_TOKEN
    return tokens


def rehearse(
    planner: VLMPlanner, instruction: str, shown: int, subgoals: Sequence[str]
) -> CallSizes:
    """Return what an episode costs if the planner names the right subgoals, one after the other.

    Args:
        planner: whose model is not asked.
        instruction: everything that is said.
        shown: control steps of the video.
        subgoals: of the goal, with points.
    """
    model = _StandIn(planner.options.model)
    planner.vlm.connect = lambda _options: model
    every = planner.memory.demonstration_frames
    frames = _frames(shown, every if isinstance(every, int) else 1)
    video = {"joint_positions": np.zeros((shown, 1)), "front_rgb": frames}
    planner.reset(instruction, cast("Demonstration", video))
    steps = SUBGOAL_STEPS * len(subgoals)
    for step in range(0, steps + CHUNK, CHUNK):
        index = step // SUBGOAL_STEPS
        model.says = [*subgoals, "done"][min(index, len(subgoals))]
        if index != max(step - CHUNK, 0) // SUBGOAL_STEPS:
            planner.learn(SubgoalEnd(subgoals[index - 1], "done", step=step))
        planner.plan(_observation(step, planner.observe_every), step)
    planner.close()
    return model.total


def rehearse_listener(listener: VLMListener, task: str, instruction: str, shown: int) -> CallSizes:
    """Return what an episode costs if the listener's first answer is a goal of the task."""
    options = listener.options
    schema = goal_schema(task)
    texts = question_texts(listener.prompts, schema, instruction, shown)
    parts: tuple[Part, ...] = (texts.instruction, texts.question)
    if options.pictures:
        frames = _frames(shown, options.frames_every)
        clip = (summary_clip(frames, options.frames, shown),) if shown else ()
        parts = texts.parts(clip, Picture(_BLANK))
    query = ModelQuery(texts.system, (ChatTurn("user", parts),))
    answer = json.dumps({one.name: "orange" for one in schema.fields})
    return CallSizes(1, size_of(query, options.model), len(answer) // LETTERS_OF_A_TOKEN)


def _frames(shown: int, every: int) -> Pixels:
    return np.broadcast_to(_BLANK, (-(-shown // every), *_BLANK.shape))


def _observation(step: int, every: int | None) -> Observation:
    now: dict[str, Any] = {"front_rgb": _BLANK}
    count = 0 if every is None else step // every - max(step - CHUNK, 0) // every
    return cast("Observation", {**now, "history": (now,) * count})


@dataclass
class _StandIn:
    """A model that adds up what it is sent, and answers with one subgoal until it has another."""

    options: ModelOptions
    says: str = ""
    total: CallSizes = field(default_factory=CallSizes)

    def answer(self, query: ModelQuery) -> ModelReply:
        """Return the subgoal in the form that is asked for."""
        fields: Mapping[str, Any] = (query.schema or {}).get("properties", {})
        lists = {name for name, kind in fields.items() if kind["type"] == "array"}
        values = {name: [] if name in lists else self.says for name in fields}
        text = json.dumps(values) if fields else self.says
        size = CallSizes(1, size_of(query, self.options), len(text) // LETTERS_OF_A_TOKEN)
        self.total = self.total.plus(size)
        return ModelReply(text)

    def close(self) -> None:
        """Do nothing."""
