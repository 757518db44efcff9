"""What planners that ask a vision-language model have in common."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import Any, ClassVar, Literal

from pydantic import BaseModel, ConfigDict, Field

from roboirg.core.observations import Demonstration, DemonstrationFrames, Observation
from roboirg.policies.planning.config_fingerprint import fingerprint_of
from roboirg.policies.planning.model_content import Pixels
from roboirg.policies.planning.models import ModelOptions
from roboirg.policies.planning.prompts import SHARED, load_prompts
from roboirg.policies.planning.vlm_query import VLMQuery

CAMERA = "front"
PLACE = "[at]"


class VLMPlannerOptions(BaseModel):
    """Options of all planners that ask a model.

    Attributes:
        model: which one, and how.
        subgoals: ``grounded``, with pixels, or ``simple``.
        keep: ask at every so many chunks only, and keep the subgoal in between.
        prompts: a file with other words, or None for our own.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    model: ModelOptions
    subgoals: Literal["grounded", "simple"] = "grounded"
    keep: int = Field(default=1, ge=1)
    prompts: str | None = None


class VLMPlanner(ABC):
    """Asks a model for subgoals; sees the front camera alone.

    Where a model gives no usable subgoal even when asked again, the last one stays.

    Raises:
        InvalidValueError: the prompts cannot be read.
    """

    kind: ClassVar[str]
    options_type: ClassVar[type[BaseModel]]
    cameras = (CAMERA,)

    def __init__(self, options: VLMPlannerOptions) -> None:
        self._common = options
        self.demonstration_frames: DemonstrationFrames = "all"
        self.prompts = load_prompts(self.kind, options.prompts)
        self._shared = load_prompts(SHARED)
        self._asker = VLMQuery(options.model, self.prompts["again"])
        self._instruction = ""
        self._chunks = 0
        self._subgoal: str | None = None

    @property
    def grounds(self) -> bool:
        """Whether subgoals name pixels."""
        return self._common.subgoals == "grounded"

    @property
    def version(self) -> str:
        """The model, and a fingerprint of the options and words that may change its answers."""
        return fingerprint_of(self._common.model, self.metadata)

    @property
    def metadata(self) -> dict[str, Any]:
        """Options and words; no key is in it."""
        own = self._common.model_dump(mode="json", exclude={"model", "prompts"})
        return {
            "kind": self.kind,
            "model": self._common.model.about(),
            "prompts": f"{self.prompts.fingerprint}-{self._shared.fingerprint}",
            **own,
        }

    def reset(self, instruction: str, demonstration: Demonstration) -> None:
        """Forget the last episode; look at what is shown."""
        self._asker.start()
        self._instruction, self._chunks, self._subgoal = instruction, 0, None
        self.begin(demonstration)

    def plan(self, observation: Observation, step: int) -> str | None:
        """The subgoal from now on: the model's, if it is to be asked now, or the last one."""
        self.watch(observation, step)
        due = self._chunks % self._common.keep == 0
        self._chunks += 1
        if due and self.due(step):
            subgoal = self.ask(observation, step)
            if subgoal is not None:
                self._subgoal = subgoal
        return self._subgoal

    @abstractmethod
    def begin(self, demonstration: Demonstration) -> None:
        """A new episode begins."""

    def watch(self, observation: Observation, step: int) -> None:  # noqa: B027 - optional
        """Something is seen; called at every chunk, whether or not the model is asked."""

    def due(self, step: int) -> bool:  # noqa: ARG002
        """Whether the model is to be asked now."""
        return True

    @abstractmethod
    def ask(self, observation: Observation, step: int) -> str | None:
        """What the model says; None if it is of no use."""

    def usage(self) -> dict[str, float]:
        """What the episode cost."""
        return self._asker.usage()

    def close(self) -> None:
        """Let go of the connection."""
        self._asker.close()

    def forms(self) -> str:
        """The forms of subgoals, one in each line."""
        lines = (f"- {form}" for form in self._shared.lines("forms"))
        if self.grounds:
            return "\n".join(lines)
        return "\n".join(line.replace(f" {PLACE}", "") for line in lines)

    def places(self) -> str:
        """How places are named, or that they are not."""
        return self.prompts.fill("grounded" if self.grounds else "simple")


def shown(demonstration: Demonstration) -> Pixels | None:
    """The front camera's pictures of a video; None where nothing was shown."""
    if not len(demonstration.get("joint_positions", ())):
        return None
    pictures: Pixels = demonstration["front_rgb"]
    return pictures


def seen(observation: Observation) -> Pixels:
    """The front camera's picture, as it is now: who draws may use the array again."""
    return observation["front_rgb"].copy()
