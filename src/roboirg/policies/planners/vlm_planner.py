"""The planner that queries a vision-language model: when it asks, and what it does with answers."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from pydantic import BaseModel, ConfigDict, Field, field_validator, model_validator

from roboirg.core.observations import Demonstration, Observation
from roboirg.core.subgoal_text import split_point
from roboirg.policies.contract.base import SubgoalEnd
from roboirg.policies.planners.memories import FINISHED, MEMORIES
from roboirg.policies.planners.memory import Memory, MemoryOptions
from roboirg.policies.planners.planner import EACH_CHUNK, WHEN_DONE
from roboirg.policies.vlm.models import ModelOptions
from roboirg.policies.vlm.models.model import config_version
from roboirg.policies.vlm.prompt_files import load_prompts
from roboirg.policies.vlm.vlm_query import VLMQuery

_EVERY = re.compile(r"every (\d+) steps")
MOST_USELESS = 5
"""Unusable replies in a row after which a planner that is asked when done asks no more."""


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


class PlannerOptions(MemoryOptions):
    """Options of a planner that queries a model.

    Attributes:
        model: the model and its options.
        asked: when it is queried: ``each-chunk``; ``when-done``, once its policy has reported the
            end of a subgoal, or something has been said; or ``every N steps``.
        keep: chunks per query; the subgoal stays in between.
        first_pause: control steps before which there is no second query.
        holds: rules that keep a subgoal.
        prompts: a file with other prompts, or None for our own.
    """

    model: ModelOptions
    asked: str = EACH_CHUNK
    keep: int = Field(default=1, ge=1)
    first_pause: int = Field(default=0, ge=0)
    holds: tuple[SubgoalHold, ...] = ()
    prompts: str | None = None

    @field_validator("asked")
    @classmethod
    def _is_a_time(cls, asked: str) -> str:
        found = _EVERY.fullmatch(asked)
        if asked in (EACH_CHUNK, WHEN_DONE) or (found is not None and int(found[1])):
            return asked
        raise ValueError(f"it must be {EACH_CHUNK}, {WHEN_DONE} or 'every N steps'")

    @model_validator(mode="after")
    def _has_no_idle_option(self) -> PlannerOptions:
        known = MEMORIES[self.remembers].options
        idle = self.model_fields_set & set(MemoryOptions.model_fields) - set(known)
        if idle:
            raise ValueError(
                f"a planner that remembers {self.remembers} has no option {min(idle)}; it has "
                f"{', '.join(known)}"
            )
        return self

    @property
    def period(self) -> int | None:
        """Control steps between queries; None if no number of steps decides."""
        found = _EVERY.fullmatch(self.asked)
        return None if found is None else int(found[1])


SETTINGS: Mapping[str, Mapping[str, Any]] = {
    "qwen": {"remembers": "subgoals", "holds": HOLDS},
    # MME-VLA has the pause for the tasks with a long first action (eight of ours, all but StopCube,
    # VideoUnmask and VideoUnmaskSwap); a policy does not know its task, so it holds for all.
    "gemini": {"remembers": "conversation", "asked": "every 48 steps", "first_pause": 75},
    "memer": {"remembers": "keyframes"},
    "stateless": {"remembers": "pictures", "asked": WHEN_DONE},
}
"""The named settings: options that differ from the defaults."""


@dataclass
class _Planning:
    """State of one episode.

    Attributes:
        instruction: everything that was said.
        subgoal: the last one.
        ends: how subgoals ended, each once.
        chunks: chunks of the policy so far.
        periods: number of the last period of ``every N steps``.
        useless: unusable replies in a row.
        news: whether something has happened on which ``when-done`` waits.
        refused: whether the last subgoal was refused.
        finished: whether the model said that the task is complete.
    """

    instruction: str
    subgoal: str | None = None
    ends: list[SubgoalEnd] = field(default_factory=list)
    chunks: int = 0
    periods: int = 0
    useless: int = 0
    news: bool = False
    refused: bool = False
    finished: bool = False


class VLMPlanner:
    """Queries a model for subgoals, with pictures of the front camera only.

    If the model gives no usable subgoal even at the second try, the last one stays.

    Args:
        options: when it asks, what it remembers, and its model.
        kind: name of its setting, for the records.
        seed: unused.

    Raises:
        InvalidValueError: the prompts cannot be read.
    """

    options_type = PlannerOptions
    settings = SETTINGS
    cameras = ("front",)
    reports = False

    def __init__(self, options: PlannerOptions, kind: str, seed: int = 0) -> None:  # noqa: ARG002
        self.options, self.kind = options, kind
        memory_class = MEMORIES[options.remembers]
        self.prompts = load_prompts(memory_class.prompts, options.prompts)
        self.memory: Memory = memory_class(options, self.prompts)
        self.observe_every = self.memory.observe_every
        self.demonstration_frames = self.memory.demonstration_frames
        self.vlm = VLMQuery(options.model, self.prompts["again"])
        self._now = _Planning("")

    @property
    def asked(self) -> str:
        """When it is queried."""
        return self.options.asked

    @property
    def version(self) -> str:
        """The model, and a fingerprint of the options and prompts that may change its answers."""
        return config_version(self.options.model, self.metadata)

    @property
    def metadata(self) -> dict[str, Any]:
        """Options and prompts; there is no key among them."""
        idle = set(MemoryOptions.model_fields) - set(self.memory.options)
        own = self.options.model_dump(mode="json", exclude={"model", "prompts", *idle})
        return {
            "kind": self.kind,
            "model": self.options.model.about(),
            "prompts": f"{self.prompts.fingerprint}-{self.memory.shared.fingerprint}",
            **own,
        }

    def reset(self, instruction: str, demonstration: Demonstration) -> None:
        """Forget the last episode and begin another."""
        self.vlm.start()
        self._now = _Planning(instruction)
        self.memory.begin(demonstration)

    def hear(self, text: str, step: int) -> None:  # noqa: ARG002
        """Remember an utterance; the next query quotes everything that was said."""
        self._now.instruction = f"{self._now.instruction} {text}"
        self._now.news = True

    def learn(self, end: SubgoalEnd) -> None:
        """Remember how a subgoal ended; one that stands is done once."""
        self._now.news = True
        self._now.refused = end.how == "refused"
        if not self._now.ends or self._now.ends[-1][:3] != end[:3]:
            self._now.ends.append(end)

    def plan(self, observation: Observation, step: int) -> str | None:
        """Return the subgoal from now on: a new one if a query is due, else the last."""
        now = self._now
        if not now.refused:
            self.memory.watch(observation, step)
            is_turn = now.chunks % self.options.keep == 0
            now.chunks += 1
            if now.finished or not (is_turn and self._due(step)):
                return now.subgoal
        now.news = now.refused = False
        query = self.memory.query(observation, now.instruction, now.ends)
        answer = self.vlm.ask(query, lambda text: self.memory.parse(text, now.subgoal))
        if answer is None:
            now.useless += 1
            now.news = True
        else:
            subgoal = self.memory.keep(answer, now.instruction)
            now.useless, now.finished = 0, subgoal == FINISHED
            now.subgoal = None if now.finished else subgoal
        return now.subgoal

    def usage(self) -> dict[str, float]:
        """Return the cost of the episode, and how the planning ended, if the model ended it.

        ``finished``: it said that the task is complete; ``unreadable``: its last replies were of no
        use.
        """
        ended = {"finished": self._now.finished, "unreadable": self._now.useless > 0}
        return {**self.vlm.usage(), **{name: 1.0 for name, holds in ended.items() if holds}}

    def close(self) -> None:
        self.vlm.close()

    def _due(self, step: int) -> bool:
        """Return whether to query the model now."""
        now, period = self._now, self.options.period
        is_new = period is None or step // period > now.periods
        now.periods = 0 if period is None else step // period
        waits = self.options.asked == WHEN_DONE
        if waits and now.useless >= MOST_USELESS:
            return False
        if now.subgoal is None:
            return True
        words, _ = split_point(now.subgoal)
        is_held = any(
            step <= one.until and re.fullmatch(one.says, words) for one in self.options.holds
        )
        return (
            is_new and (now.news or not waits) and step >= self.options.first_pause and not is_held
        )
