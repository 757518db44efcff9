"""A vision-language model names the goal; the scripted expert executes it.

The model receives what a policy may know: the instruction, the video, the first picture, and for
each slot of the task its possible values in any scene. The scene itself is read only to execute
the goal.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from pydantic import BaseModel, ConfigDict
from pydantic import Field as Option

from roboirg.core.episode import Goal
from roboirg.core.observations import Demonstration
from roboirg.policies.builtin.scripted import ScriptedPolicy
from roboirg.policies.contract.goal_naming import SaidAndShown
from roboirg.policies.vlm.goal_schema import GoalSchema, goal_schema
from roboirg.policies.vlm.listener_query import PROMPTS, question_texts
from roboirg.policies.vlm.model_content import ChatTurn, Part, summary_clip
from roboirg.policies.vlm.models import Model, ModelOptions, ModelQuery, make_model
from roboirg.policies.vlm.models.model import config_version
from roboirg.policies.vlm.prompt_files import load_prompts
from roboirg.policies.vlm.vlm_query import VLMQuery
from roboirg.tasks import goals_of
from roboirg.util.media import Picture

if TYPE_CHECKING:
    from roboirg.envs.environment import RoboIRGEnv

CAMERA = "front"


class ListenerOptions(BaseModel):
    """Options of a VLM listener.

    Attributes:
        model: the model and its options.
        frames: maximum of video frames, evenly spaced.
        frames_every: control steps between the video frames that are rendered.
        pictures: whether the model gets pictures and video; no for one that reads text only.
        reasoning: whether the answer begins with a field in which the model may think.
        prompts: a file with other prompts, or None for our own.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    model: ModelOptions
    frames: int = Option(default=16, ge=1)
    frames_every: int = Option(default=8, ge=1)
    pictures: bool = True
    reasoning: bool = False
    prompts: str | None = None


class VLMNamer:
    """Names the goal that a vision-language model understands, from words and pictures alone.

    Args:
        options: of the listener and its model.
        connect: connects the model.

    Raises:
        InvalidValueError: the prompts cannot be read.
    """

    cameras: tuple[str, ...] = (CAMERA,)

    def __init__(
        self, options: ListenerOptions, connect: Callable[[ModelOptions], Model] = make_model
    ) -> None:
        """Load the prompts; the model is connected at the first query."""
        self.options = options
        self.demonstration_frames: int | str = options.frames_every
        if not options.pictures:
            self.cameras = ()
            self.demonstration_frames = "none"
        self.prompts = load_prompts(PROMPTS, options.prompts)
        self._vlm = VLMQuery(options.model, self.prompts["again"], connect)
        self._configuration: dict[str, Any] = {
            "model": options.model.about(),
            "prompts": self.prompts.fingerprint,
            **options.model_dump(mode="json", exclude={"model", "prompts"}),
        }

    @property
    def metadata(self) -> dict[str, Any]:
        """Options and prompts; there is no key among them."""
        return self._configuration

    @property
    def version(self) -> str:
        """The model, and a fingerprint of the options and prompts that may change its answers."""
        return config_version(self.options.model, self._configuration)

    def start(self) -> None:
        """Reset the costs for a new episode."""
        self._vlm.start()

    def usage(self) -> dict[str, float]:
        """Return the costs of the episode."""
        return self._vlm.usage()

    def name_goal(self, given: SaidAndShown) -> Goal | None:
        """Return the goal that the model names; None if it gives no valid answer.

        Raises:
            PolicyConnectionError: the model cannot be reached.
            PolicyTimeoutError: it did not answer in time.
            PolicyReplyError: it replied with an error.
        """
        schema = goal_schema(given.task)
        return self._vlm.ask(self._build_query(given, schema), schema.read)

    def _build_query(self, given: SaidAndShown, schema: GoalSchema) -> ModelQuery:
        """Return the query for the goal of an instruction, with video and picture if it has any.

        Args:
            given: what was said and shown.
            schema: of the answer.
        """
        reasoning = None
        if self.options.reasoning:
            reasoning = self.prompts.fill("reasoning_field")
        steps = len(given.demonstration.get("joint_positions", ()))
        texts = question_texts(self.prompts, schema, given.text, steps, reasoning)
        if self.options.pictures:
            video = self._video(given.demonstration, steps)
            parts = texts.parts(video, Picture(given.take_picture()))
        else:
            parts = (texts.instruction, texts.question)
        turn = ChatTurn("user", parts)
        return ModelQuery(texts.system, (turn,), schema.schema(reasoning))

    def _video(self, demonstration: Demonstration, steps: int) -> tuple[Part, ...]:
        """Return the demonstration, of `steps` control steps, as a clip in a tuple, or no clip."""
        if not steps:
            return ()
        frames = demonstration[f"{CAMERA}_rgb"]
        return (summary_clip(frames, self.options.frames, steps),)


class VLMListener(VLMNamer, ScriptedPolicy):
    """Executes the goal that a vision-language model names.

    If the model gives no valid answer even to a second query, or names objects that the scene does
    not have, the robot holds still until time is up: a failure that cannot succeed by luck.
    `usage` counts both cases (``unparsed``, ``impossible``).

    Args:
        options: of the listener and its model.
        seed: unused.
        connect: connects the model.

    Raises:
        InvalidValueError: the prompts cannot be read.
    """

    def __init__(
        self,
        options: ListenerOptions,
        seed: int = 0,
        connect: Callable[[ModelOptions], Model] = make_model,
    ) -> None:
        """Check the options; what the model is shown, this policy needs."""
        ScriptedPolicy.__init__(self, seed)
        VLMNamer.__init__(self, options, connect)
        self.understood: Goal | None = None
        self._demonstration: Demonstration = {}
        self._impossible = False

    @property
    def metadata(self) -> dict[str, Any]:
        """Options and prompts, and the goal that the model named (None if none was valid)."""
        understood = None
        if self.understood is not None:
            understood = dict(self.understood.as_mapping())
        return {**self._configuration, "understood": understood}

    def reset(self, instruction: str, demonstration: Demonstration) -> None:
        """Begin an episode: query the goal from the model and begin to execute it.

        If more of the instruction is still to come, the model is queried after its end, in `hear`.

        Args:
            instruction: what was said so far; more comes through `hear`.
            demonstration: arrays of the video; empty without one.

        Raises:
            PolicyConnectionError: the model cannot be reached.
            PolicyTimeoutError: it did not answer in time.
            PolicyReplyError: it replied with an error.
        """
        self.start()
        self._demonstration = demonstration
        self.understood = None
        self._impossible = False
        # Last, because it may call `decide`, which needs the demonstration and sets the goal.
        super().reset(instruction, demonstration)

    def decide(self, env: RoboIRGEnv, instruction: str) -> Goal | None:
        """Return the goal that the model names; None if it names none, or one not in this scene.

        Called once an episode, when all has been said. Keeps the goal for the records in any case.
        """
        given = SaidAndShown.of(env, instruction, self._demonstration)
        goal = self.name_goal(given)
        self.understood = goal
        if goal is not None and goal not in goals_of(env.episode):
            self._impossible = True
            return None
        return goal

    def usage(self) -> dict[str, float]:
        """Return the cost of the episode."""
        return {**super().usage(), "impossible": int(self._impossible)}
