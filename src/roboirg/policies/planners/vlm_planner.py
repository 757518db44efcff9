"""The planner that queries a vision-language model: when it asks, and what it does with answers."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterable, Iterator, Mapping
from typing import Any, ClassVar, Generic, TypeVar

from pydantic import Field

from roboirg.core.environment_options import DemonstrationFrames
from roboirg.core.observations import Demonstration, Observation, Pixels
from roboirg.policies.contract.base import SubgoalEnd
from roboirg.policies.planners.planner import EACH_CHUNK, SubgoalOptions
from roboirg.policies.planners.points import says_finished
from roboirg.policies.planners.query_schedule import Asked, QuerySchedule
from roboirg.policies.vlm.model_content import ChatTurn, Part, summary_clip
from roboirg.policies.vlm.models import ModelOptions, ModelQuery
from roboirg.policies.vlm.models.model import config_version
from roboirg.policies.vlm.prompt_files import SHARED, load_prompts
from roboirg.policies.vlm.vlm_query import VLMQuery
from roboirg.util.media import Clip
from roboirg.util.reply_reading import UnparsableReplyError

FINISHED = ""
"""Stands for the answer that the task is complete."""


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
        self._schedule = QuerySchedule(self.asked, self.options.first_pause, self.holds)
        self._was_refused = False
        self._is_finished = False
        self.video: Pixels | None = None
        if len(demonstration.get("joint_positions", ())):
            self.video = demonstration["front_rgb"]
        self._summary: Clip | None = None
        self.forget()

    def forget(self) -> None:
        """Forget what was remembered of the last episode."""

    def hear(self, text: str, step: int) -> None:  # noqa: ARG002
        """Remember an utterance; the next query quotes everything that was said."""
        self.instruction = f"{self.instruction} {text}"
        self._schedule.has_news = True

    def learn(self, end: SubgoalEnd) -> None:
        """Remember how a subgoal ended; the same end several times in a row counts once."""
        self._schedule.has_news = True
        self._was_refused = end.how == "refused"
        if self.ends:
            last = self.ends[-1]
            is_same = (last.subgoal, last.how, last.why) == (end.subgoal, end.how, end.why)
            if is_same:
                return
        self.ends.append(end)

    def plan(self, observation: Observation, step: int) -> str | None:
        """Return the subgoal from now on: a new one if a query is due, else the last.

        After a refused subgoal a query is always due. Without a usable reply the last one stays.
        """
        if not self._was_refused:
            self.watch(observation, step)
            if self._is_finished or not self._schedule.is_due(self.subgoal, step):
                return self.subgoal
        self._was_refused = False
        subgoal = self.vlm.ask(self.query(observation), self.take)
        self._schedule.note_reply(is_useful=subgoal is not None)
        if subgoal is not None:
            self._is_finished = subgoal == FINISHED
            self.subgoal = subgoal or None
        return self.subgoal

    def usage(self) -> dict[str, float]:
        """Return the cost of the episode, and how the planning ended, if the model ended it.

        ``finished``: it said that the task is complete; ``unreadable``: its last replies were of no
        use.
        """
        usage = self.vlm.usage()
        if self._is_finished:
            usage["finished"] = 1.0
        if self._schedule.useless > 0:
            usage["unreadable"] = 1.0
        return usage

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
        if self.video is None:
            return
        if self._summary is None:
            self._summary = summary_clip(self.video, most, len(self.video))
        yield self.fill("video")
        yield self._summary

    def single(self, parts: Iterable[Part], schema: dict[str, Any] | None = None) -> ModelQuery:
        """Return a query of one turn."""
        turn = ChatTurn("user", tuple(parts))
        return ModelQuery(self.fill("system"), (turn,), schema)

    def finishes(self, subgoal: str) -> bool:
        """Return whether a subgoal says that the task is complete; not before anything was done."""
        is_end = says_finished(subgoal)
        if is_end and self.subgoal is None:
            raise UnparsableReplyError("Nothing has been done yet.")
        return is_end
