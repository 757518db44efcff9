"""A vision-language model in front of the oracle's hands: it says what is meant, they do it.

What the model is told is what a policy may know: the words, the video, the first picture, and for
each slot of the task the values that it can have in any scene. The scene itself is looked at only
to move the hands.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

from pydantic import BaseModel, ConfigDict
from pydantic import Field as Option

from roboirg.core.episode import Goal
from roboirg.core.observations import Demonstration
from roboirg.policies.builtin.scripted import ScriptedPolicy
from roboirg.policies.planning.config_fingerprint import fingerprint_of
from roboirg.policies.planning.goal_schema import Field, GoalSchema, goal_schema
from roboirg.policies.planning.model_content import ChatTurn, Part, Picture, summary
from roboirg.policies.planning.models import ModelOptions, ModelQuery
from roboirg.policies.planning.prompts import load_prompts
from roboirg.policies.planning.vlm_query import VLMQuery
from roboirg.tasks import get_task

if TYPE_CHECKING:
    from roboirg.envs.environment import RoboIRGEnv

CAMERA = "front"
PROMPTS = "listener"


class ListenerOptions(BaseModel):
    """How a listener asks.

    Attributes:
        model: which model it asks, and how.
        frames: pictures of the video at most, evenly spaced.
        frames_every: control steps between the pictures of the video that are drawn at all.
        reasoning: whether the answer has a field in which the model may think first.
        prompts: a file with other words, or None for our own.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    model: ModelOptions
    frames: int = Option(default=16, ge=1)
    frames_every: int = Option(default=8, ge=1)
    reasoning: bool = False
    prompts: str | None = None


class NotUnderstood(Exception):  # noqa: N818 - an outcome; never leaves `VLMListener.reset`
    """There is no goal to pursue."""


class VLMListener(ScriptedPolicy):
    """Understands what a vision-language model understands, and does it with the oracle's hands.

    If the model gives no valid answer, even when asked again, or means what is not there, the
    robot stays at rest until time is up: a failure of understanding like any other, and never a
    lucky one. `usage` tells how often (``unparsed``, ``impossible``).

    Raises:
        InvalidValueError: the prompts cannot be read.
    """

    cameras = (CAMERA,)

    def __init__(self, options: ListenerOptions, seed: int = 0) -> None:
        super().__init__(seed)
        self.options = options
        self.demonstration_frames = options.frames_every
        self.prompts = load_prompts(PROMPTS, options.prompts)
        self.understood: Goal | None = None
        self._asker = VLMQuery(options.model, self.prompts["again"])
        self._demonstration: Demonstration = {}
        self._impossible = 0

    @property
    def version(self) -> str:
        """The model, and a fingerprint of the options and words that may change its answers."""
        return fingerprint_of(self.options.model, self.metadata_of_options())

    @property
    def metadata(self) -> dict[str, Any]:
        """Options and words, and what the model took to be meant (None if nothing valid)."""
        goal = self.understood
        understood = None if goal is None else dict(goal.as_mapping())
        return {**self.metadata_of_options(), "understood": understood}

    def metadata_of_options(self) -> dict[str, Any]:
        """What is known before anything is asked; no key is in it."""
        own = self.options.model_dump(mode="json", exclude={"model", "prompts"})
        return {
            "model": self.options.model.about(),
            "prompts": self.prompts.fingerprint,
            **own,
        }

    def reset(self, instruction: str, demonstration: Demonstration) -> None:
        """Ask what is meant and begin to do it.

        Raises:
            PolicyConnectionError: the model cannot be reached.
            PolicyTimeoutError: it did not answer in time.
            PolicyReplyError: it answered with an error.
        """
        self._asker.start()
        self._demonstration, self.understood, self._impossible = demonstration, None, 0
        self._chunks = iter(())
        try:
            super().reset(instruction, demonstration)
        except NotUnderstood:
            return
        finally:
            self._demonstration = {}

    def decide(self, env: RoboIRGEnv, instruction: str) -> Goal:
        """The goal that the model takes to be meant.

        Raises:
            NotUnderstood: it gave no valid answer, or none that this scene allows.
        """
        slots = goal_schema(env.episode.task)
        picture = Picture(env.picture(CAMERA))
        goal = self._asker.ask(self._query(slots, instruction, picture), slots.read)
        self.understood = goal
        if goal is None:
            raise NotUnderstood
        if goal not in get_task(env.episode.task).goals(env.episode.scene):
            self._impossible += 1
            raise NotUnderstood
        return goal

    def usage(self) -> dict[str, float]:
        """What the episode cost."""
        return {**self._asker.usage(), "impossible": self._impossible}

    def close(self) -> None:
        """Let go of the connection."""
        self._asker.close()

    def _query(self, slots: GoalSchema, instruction: str, picture: Picture) -> ModelQuery:
        words, reasoning = self.prompts, None
        if self.options.reasoning:
            reasoning = words.fill("reasoning_field")
        listing = "\n".join(self._lines(slots, reasoning))
        parts: tuple[Part, ...] = (
            words.fill("instruction", instruction=instruction),
            *self._video(),
            words.fill("now"),
            picture,
            words.fill("question", fields=listing),
        )
        return ModelQuery(words.fill("system"), (ChatTurn("user", parts),), slots.schema(reasoning))

    def _video(self) -> Iterator[Part]:
        steps = len(self._demonstration.get("joint_positions", ()))
        if not steps:
            yield self.prompts.fill("no_video")
            return
        yield self.prompts.fill("video", steps=str(steps))
        yield summary(self._demonstration[f"{CAMERA}_rgb"], self.options.frames, steps)

    def _lines(self, slots: GoalSchema, reasoning: str | None) -> Iterator[str]:
        if reasoning is not None:
            yield f"- reasoning: {reasoning}"
        for field in slots.fields:
            meaning = self.prompts.fill(
                f"meanings.{field.kind}", color=field.name, thing=slots.thing
            )
            values = self._values(field)
            yield self.prompts.fill("field", name=field.name, meaning=meaning, values=values)

    def _values(self, field: Field) -> str:
        listed = ", ".join(map(str, field.values))
        if field.lengths is None:
            return self.prompts.fill("values.one", values=listed)
        least, most = map(str, field.lengths)
        return self.prompts.fill("values.list", values=listed, least=least, most=most)
