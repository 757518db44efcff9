"""Base class of planners that query a vision-language model (VLM) for the next subgoal."""

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
"""Subgoal that stands for the answer that the task is complete."""


class PlannerOptions(SubgoalOptions):
    """Options of a planner that queries a model.

    Attributes:
        model: the model and its options.
        asked: when it is queried: ``each-chunk``; ``when-done``, once its policy has reported the
            end of a subgoal, or something has been said; or ``every N steps``.
        first_pause: control steps of the episode before which there is no second query.
        prompts: a file with other prompts, or None for our own.
    """

    model: ModelOptions
    asked: Asked = EACH_CHUNK
    first_pause: int = Field(default=0, ge=0)
    prompts: str | None = None


Options = TypeVar("Options", bound=PlannerOptions)


class VLMPlanner(ABC, Generic[Options]):
    """Queries a model for subgoals, with pictures of the front camera only.

    For each chunk of actions, `plan` lets it `watch` the observation; if a query is due
    (`QuerySchedule`), it sends that of `make_query`, and `read_reply` finds the subgoal in the
    reply. If the model gives no usable subgoal even at the second try, the last one stays. A
    subclass says what it remembers, what it asks, and how it reads a reply.

    Args:
        options: when it asks, what it remembers, and its model.
        kind: name of its prompts, also for the records.
        seed: unused, as models have their own.

    Attributes:
        subgoal: the last one; None before the first, and when the task is complete.
        instruction: everything that was said, joined by spaces.
        ends: how subgoals ended, in order, without repetitions in a row.
        video: the demonstration's frames, uint8 (T, height, width, 3); None without one.

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
        """The model, with a fingerprint of the options and prompts that may change its answers."""
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
        """Forget the last episode and begin another; an empty demonstration means no video."""
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
        """Forget what a subclass has remembered of the last episode; called by `reset`."""

    def hear(self, text: str, step: int) -> None:  # noqa: ARG002
        """Remember an utterance; the next query quotes everything that was said."""
        self.instruction = f"{self.instruction} {text}"
        self._schedule.has_news = True

    def learn(self, end: SubgoalEnd) -> None:
        """Remember how a subgoal ended, which is news to ask about.

        The same end several times in a row, at whatever step, is kept once.
        """
        self._schedule.has_news = True
        self._was_refused = end.how == "refused"
        if self.ends:
            last = self.ends[-1]
            is_same = (last.subgoal, last.how, last.why) == (end.subgoal, end.how, end.why)
            if is_same:
                return
        self.ends.append(end)

    def plan(self, observation: Observation, step: int) -> str | None:
        """Return the subgoal from now on: a new one if a query is due, else the last; None if done.

        After a refused subgoal a query is always due, and the observation has been watched already.
        Without a usable reply the last subgoal stays.
        """
        if not self._was_refused:
            self.watch(observation, step)
            if self._is_finished or not self._schedule.is_due(self.subgoal, step):
                return self.subgoal
        self._was_refused = False
        subgoal = self.vlm.ask(self.make_query(observation), self.read_reply)
        self._schedule.note_reply(is_useful=subgoal is not None)
        if subgoal is not None:
            self._is_finished = subgoal == FINISHED
            self.subgoal = subgoal or None
        return self.subgoal

    def usage(self) -> dict[str, float]:
        """Return the cost of the episode: ``{"calls": 3, "input_tokens": 2100, ...}``.

        ``finished`` is added if the model said that the task is complete, and ``unreadable`` if its
        last reply was of no use.
        """
        usage = self.vlm.usage()
        if self._is_finished:
            usage["finished"] = 1.0
        if self._schedule.useless:
            usage["unreadable"] = 1.0
        return usage

    def watch(self, observation: Observation, step: int) -> None:
        """Remember what a later query needs of an observation; called for every chunk.

        Args:
            observation: now, with the history since the last call.
            step: control steps of the episode so far.
        """

    @abstractmethod
    def make_query(self, observation: Observation) -> ModelQuery:
        """Return the next query to the model, with the observation as it is now."""

    @abstractmethod
    def read_reply(self, text: str) -> str:
        """Return the subgoal in the text of a reply to the last query, with points in pixels.

        What later queries need of the reply is remembered. `FINISHED` if the task is complete.

        Raises:
            UnparsableReplyError: the reply holds no subgoal; nothing is remembered of it.
        """

    def subgoal_prompts(self) -> dict[str, str]:
        """Return texts for prompts: ``forms`` of subgoals, and how to write points (``places``).

        The forms are one per line, ``- pick up the cube [at]``, without ``[at]`` where subgoals are
        simple.
        """
        text = "\n".join(f"- {form}" for form in self.shared.lines("forms"))
        if self.options.subgoals == "simple":
            text = text.replace(" [at]", "")
        return {"forms": text, "places": self.fill(self.options.subgoals)}

    def instruction_prompt(self) -> str:
        """Return the prompt with everything that was said."""
        return self.fill("goal", instruction=self.instruction)

    def video_parts(self, most: int) -> Iterator[Part]:
        """Yield a prompt and the demonstration as a clip of at most `most` frames, encoded once.

        Nothing without a demonstration.
        """
        if self.video is None:
            return
        if self._summary is None:
            self._summary = summary_clip(self.video, most, len(self.video))
        yield self.fill("video")
        yield self._summary

    def single_turn_query(
        self, parts: Iterable[Part], schema: dict[str, Any] | None = None
    ) -> ModelQuery:
        """Return a query of one turn, without earlier ones.

        Args:
            parts: texts, pictures and clips of the turn, in order.
            schema: JSON schema of the reply; None for a reply in free text.
        """
        turn = ChatTurn("user", tuple(parts))
        return ModelQuery(self.fill("system"), (turn,), schema)

    def says_complete(self, subgoal: str) -> bool:
        """Return whether a subgoal says that the task is complete: *task completed*.

        Raises:
            UnparsableReplyError: it does, but no subgoal was named before.
        """
        is_end = says_finished(subgoal)
        if is_end and self.subgoal is None:
            raise UnparsableReplyError("Nothing has been done yet.")
        return is_end
