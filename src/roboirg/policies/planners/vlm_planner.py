"""Base class of planners that query a vision-language model."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import Any, ClassVar, Literal

from pydantic import BaseModel, ConfigDict, Field

from roboirg.core.observations import Demonstration, DemonstrationFrames, Observation
from roboirg.policies.vlm.models import ModelOptions
from roboirg.policies.vlm.models.model import config_version
from roboirg.policies.vlm.prompt_files import SHARED, load_prompts
from roboirg.policies.vlm.vlm_query import VLMQuery
from roboirg.util.media import Pixels

CAMERA = "front"
PLACE = "[at]"


class VLMPlannerOptions(BaseModel):
    """Options of all planners that query a model.

    Attributes:
        model: the model and its options.
        subgoals: ``grounded``, with pixels, or ``simple``.
        keep: chunks per query; the subgoal stays in between.
        prompts: a file with other prompts, or None for our own.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    model: ModelOptions
    subgoals: Literal["grounded", "simple"] = "grounded"
    keep: int = Field(default=1, ge=1)
    prompts: str | None = None


class VLMPlanner(ABC):
    """Queries a model for subgoals, with pictures of the front camera only.

    If the model gives no usable subgoal even at the second try, the last one stays.
    """

    kind: ClassVar[str]
    options_type: ClassVar[type[BaseModel]]
    cameras = (CAMERA,)

    def __init__(self, options: VLMPlannerOptions) -> None:
        self._common = options
        self.demonstration_frames: DemonstrationFrames = "all"
        self.prompts = load_prompts(self.kind, options.prompts)
        self._shared = load_prompts(SHARED)
        self._vlm = VLMQuery(options.model, self.prompts["again"])
        self._instruction = ""
        self._chunks = 0
        self._subgoal: str | None = None

    @property
    def is_grounded(self) -> bool:
        """Whether subgoals contain pixels."""
        return self._common.subgoals == "grounded"

    @property
    def version(self) -> str:
        """The model, and a fingerprint of the options and prompts that may change its answers."""
        return config_version(self._common.model, self.metadata)

    @property
    def metadata(self) -> dict[str, Any]:
        """Options and prompts; there is no key among them."""
        own = self._common.model_dump(mode="json", exclude={"model", "prompts"})
        return {
            "kind": self.kind,
            "model": self._common.model.about(),
            "prompts": f"{self.prompts.fingerprint}-{self._shared.fingerprint}",
            **own,
        }

    def reset(self, instruction: str, demonstration: Demonstration) -> None:
        """Forget the last episode and begin another."""
        self._vlm.start()
        self._instruction, self._chunks, self._subgoal = instruction, 0, None
        self.begin(demonstration)

    def hear(self, text: str, step: int) -> None:  # noqa: ARG002
        """Remember an utterance; the next query quotes everything that was said."""
        self._instruction = f"{self._instruction} {text}"

    def plan(self, observation: Observation, step: int) -> str | None:
        """Return the subgoal from now on: a new one if a query is due, else the last."""
        self.watch(observation, step)
        is_turn = self._chunks % self._common.keep == 0
        self._chunks += 1
        if is_turn and self.due(step):
            subgoal = self.ask(observation, step)
            if subgoal is not None:
                self._subgoal = subgoal
        return self._subgoal

    @abstractmethod
    def begin(self, demonstration: Demonstration) -> None:
        """Begin an episode."""

    def watch(self, observation: Observation, step: int) -> None:  # noqa: B027 - optional
        """Record an observation; called at every chunk, with or without a query."""

    def due(self, step: int) -> bool:  # noqa: ARG002
        """Return whether to query the model now."""
        return True

    @abstractmethod
    def ask(self, observation: Observation, step: int) -> str | None:
        """Query the model and return its subgoal; None if there is no usable one."""

    def usage(self) -> dict[str, float]:
        """Return the cost of the episode."""
        return self._vlm.usage()

    def close(self) -> None:
        self._vlm.close()

    def forms(self) -> str:
        """Return the forms of subgoals, one per line."""
        lines = (f"- {form}" for form in self._shared.lines("forms"))
        if self.is_grounded:
            return "\n".join(lines)
        return "\n".join(line.replace(f" {PLACE}", "") for line in lines)

    def places(self) -> str:
        """Return the prompt about points: their form, or that there are none."""
        return self.prompts.fill("grounded" if self.is_grounded else "simple")


def demonstration_pictures(demonstration: Demonstration) -> Pixels | None:
    """Return the front camera's pictures of a demonstration; None without a video."""
    if not len(demonstration.get("joint_positions", ())):
        return None
    pictures: Pixels = demonstration["front_rgb"]
    return pictures


def front_picture(observation: Observation) -> Pixels:
    """Return a copy of the front camera's picture, as the renderer may reuse the array."""
    return observation["front_rgb"].copy()
