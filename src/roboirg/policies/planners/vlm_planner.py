"""The planner that queries a vision-language model: when it asks, and what it does with answers."""

from __future__ import annotations

import re
from abc import ABC, abstractmethod
from collections.abc import Iterable, Iterator, Mapping
from typing import Annotated, Any, ClassVar, Generic, TypeVar

from pydantic import Field

from roboirg.core.environment_options import DemonstrationFrames
from roboirg.core.observations import Demonstration, Observation, Pixels
from roboirg.core.subgoal_text import split_point
from roboirg.policies.contract.base import SubgoalEnd
from roboirg.policies.planners.planner import EACH_CHUNK, WHEN_DONE, SubgoalOptions
from roboirg.policies.planners.points import says_finished
from roboirg.policies.vlm.model_content import ChatTurn, Part, summary_clip
from roboirg.policies.vlm.models import ModelOptions, ModelQuery
from roboirg.policies.vlm.models.model import config_version
from roboirg.policies.vlm.prompt_files import SHARED, load_prompts
from roboirg.policies.vlm.vlm_query import VLMQuery
from roboirg.util.media import Clip
from roboirg.util.reply_reading import UnparsableReplyError

FINISHED = ""
"""Stands for the answer that the task is complete."""
MOST_USELESS = 5
"""Unusable replies in a row after which a planner that is asked when done asks no more."""


Asked = Annotated[str, Field(pattern=rf"^({EACH_CHUNK}|{WHEN_DONE}|every [1-9]\d* steps)$")]


class PlannerOptions(SubgoalOptions):
    """Options of a planner that queries a model.

    Attributes:
        model: the model and its options.
        asked: when it is queried: ``each-chunk``; ``when-done``, once its policy has reported the
            end of a subgoal, or something has been said; or ``every N steps``.
        first_pause: control steps before which there is no second query.
        prompts: a file with other prompts, or None for our own.
    """

    model: ModelOptions
    asked: Asked = EACH_CHUNK
    first_pause: int = Field(default=0, ge=0)
    prompts: str | None = None


Options = TypeVar("Options", bound=PlannerOptions)


class VLMPlanner(ABC, Generic[Options]):
    """Queries a model for subgoals, with pictures of the front camera only.

    If the model gives no usable subgoal even at the second try, the last one stays.

    Args:
        options: when it asks, what it remembers, and its model.
        kind: name of its prompts, also for the records.
        seed: unused.

    Attributes:
        subgoal: the last one; None before the first, and when the task is complete.
        instruction: everything that was said.
        ends: how subgoals ended, each once.
        video: the demonstration's frames; None without one.

    Raises:
        InvalidValueError: the prompts cannot be read.
    """

    options_type: ClassVar[type[PlannerOptions]]
    holds: ClassVar[Mapping[str, int]] = {}
    """Subgoals without points that are kept, and the last control steps at which they are."""
    cameras = ("front",)
    reports = False
    demonstration_frames: DemonstrationFrames = "all"

    def __init__(self, options: Options, kind: str, seed: int = 0) -> None:  # noqa: ARG002
        self.options = options
        self.kind = kind
        self.asked = options.asked
        self.observe_every: int | None = getattr(options, "observe_every", None)
        self.prompts = load_prompts(kind, options.prompts)
        self.shared = load_prompts(SHARED)
        self.fill = self.prompts.fill
        self.vlm = VLMQuery(options.model, self.prompts["again"])
        self.reset("", {})

    @property
    def version(self) -> str:
        """The model, and a fingerprint of the options and prompts that may change its answers."""
        return config_version(self.options.model, self.metadata)

    @property
    def metadata(self) -> dict[str, Any]:
        """Options and prompts; there is no key among them."""
        return {
            "kind": self.kind,
            "model": self.options.model.about(),
            "prompts": f"{self.prompts.fingerprint}-{self.shared.fingerprint}",
            **self.options.model_dump(mode="json", exclude={"model", "prompts"}),
        }

    def reset(self, instruction: str, demonstration: Demonstration) -> None:
        """Forget the last episode and begin another."""
        self.vlm.start()
        self.instruction = instruction
        self.subgoal: str | None = None
        self.ends: list[SubgoalEnd] = []
        self._periods = self._useless = 0
        self._news = self._refused = self._finished = False
        seen = len(demonstration.get("joint_positions", ()))
        self.video: Pixels | None = demonstration["front_rgb"] if seen else None
        self._summary: Clip | None = None
        self.forget()

    def forget(self) -> None:
        """Forget what was remembered of the last episode."""

    def hear(self, text: str, step: int) -> None:  # noqa: ARG002
        """Remember an utterance; the next query quotes everything that was said."""
        self.instruction = f"{self.instruction} {text}"
        self._news = True

    def learn(self, end: SubgoalEnd) -> None:
        """Remember how a subgoal ended; one that stands is done once."""
        self._news = True
        self._refused = end.how == "refused"
        if not self.ends or self.ends[-1][:3] != end[:3]:
            self.ends.append(end)

    def plan(self, observation: Observation, step: int) -> str | None:
        """Return the subgoal from now on: a new one if a query is due, else the last."""
        if not self._refused:
            self.watch(observation, step)
            if self._finished or not self._due(step):
                return self.subgoal
        self._news = self._refused = False
        subgoal = self.vlm.ask(self.query(observation), self.take)
        if subgoal is None:
            self._useless += 1
            self._news = True
        else:
            self._useless = 0
            self._finished = subgoal == FINISHED
            self.subgoal = subgoal or None
        return self.subgoal

    def usage(self) -> dict[str, float]:
        """Return the cost of the episode, and how the planning ended, if the model ended it.

        ``finished``: it said that the task is complete; ``unreadable``: its last replies were of no
        use.
        """
        ended = {"finished": self._finished, "unreadable": self._useless > 0}
        return {**self.vlm.usage(), **{name: 1.0 for name, holds in ended.items() if holds}}

    def watch(self, observation: Observation, step: int) -> None:
        """Record an observation; called at every chunk, with or without a query."""

    @abstractmethod
    def query(self, observation: Observation) -> ModelQuery:
        """Return the next query."""

    @abstractmethod
    def take(self, text: str) -> str:
        """Return the subgoal of the reply to the last query, with pixels, and remember it.

        Raises:
            UnparsableReplyError: the reply holds no subgoal; nothing is remembered of it.
        """

    def forms(self) -> dict[str, str]:
        """Return the forms of subgoals, one per line, and the prompt about points."""
        text = "\n".join(f"- {form}" for form in self.shared.lines("forms"))
        if self.options.subgoals == "simple":
            text = text.replace(" [at]", "")
        return {"forms": text, "places": self.fill(self.options.subgoals)}

    def goal(self) -> str:
        """Return the prompt with everything that was said."""
        return self.fill("goal", instruction=self.instruction)

    def video_parts(self, most: int) -> Iterator[Part]:
        """Yield the demonstration as a clip of at most `most` frames, encoded once."""
        if self.video is not None:
            self._summary = self._summary or summary_clip(self.video, most, len(self.video))
            yield self.fill("video")
            yield self._summary

    def single(self, parts: Iterable[Part], schema: dict[str, Any] | None = None) -> ModelQuery:
        """Return a query of one turn."""
        return ModelQuery(self.fill("system"), (ChatTurn("user", tuple(parts)),), schema)

    def finishes(self, subgoal: str) -> bool:
        """Return whether a subgoal says that the task is complete; not before anything was done."""
        is_end = says_finished(subgoal)
        if is_end and self.subgoal is None:
            raise UnparsableReplyError("Nothing has been done yet.")
        return is_end

    def _due(self, step: int) -> bool:
        """Return whether to query the model now."""
        waits = self.asked == WHEN_DONE
        period = re.search(r"\d+", self.asked)
        number = step // int(period[0]) if period else 0
        is_new = period is None or number > self._periods
        self._periods = number
        if waits and self._useless >= MOST_USELESS:
            return False
        if self.subgoal is None:
            return True
        words, _ = split_point(self.subgoal)
        is_held = step <= self.holds.get(words, -1) or step < self.options.first_pause
        return is_new and (self._news or not waits) and not is_held
