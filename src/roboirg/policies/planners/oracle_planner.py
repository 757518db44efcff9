"""The oracle planner: names the subgoals of the environment, which knows the goal."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from pydantic import BaseModel

from roboirg.core.episode import HANDLES_HELD, Stage
from roboirg.core.errors import InvalidValueError
from roboirg.core.observations import Demonstration, Observation
from roboirg.core.subgoal_text import EMPTY_HAND
from roboirg.policies.contract.base import AttachedPolicy, SubgoalEnd
from roboirg.policies.planners.planner import SubgoalOptions

if TYPE_CHECKING:
    from roboirg.envs.environment import RoboIRGEnv

PRESS_STEPS = 28
"""Control steps from the beginning of a press until the button is down, within two."""


class OraclePlanner(AttachedPolicy):
    """Names the stage of the true goal that is due, in words. Privileged.

    To a policy that reports how subgoals end (the scripted hands), it also says how many steps to
    wait, and names a pick again where what was picked is lost.

    Attributes:
        reports: whether the policy reports so; set by the `HierarchicalPolicy` of both.
    """

    options_type: type[BaseModel] = SubgoalOptions
    version = "built-in"
    reports = False

    def __init__(
        self,
        options: SubgoalOptions | None = None,
        kind: str = "oracle",
        seed: int = 0,  # noqa: ARG002 - of planners that choose
    ) -> None:
        self.options = options or SubgoalOptions()
        self.kind = kind
        self.grounded = self.options.subgoals == "grounded"

    @property
    def metadata(self) -> dict[str, Any]:
        return {"kind": self.kind, **self.options.model_dump(mode="json")}

    def attach(self, env: RoboIRGEnv) -> None:
        """Receive the environment.

        Raises:
            InvalidValueError: it does not provide pixels, which grounded subgoals need.
        """
        if self.grounded and not env.grounded:
            raise InvalidValueError(
                "The oracle planner needs pixels, which the environment does not provide; make it "
                "with grounded=True, or set subgoals=simple."
            )
        super().attach(env)

    def reset(self, instruction: str, demonstration: Demonstration) -> None:  # noqa: ARG002
        """Begin an episode, in which no subgoal has ended yet."""
        self._last: SubgoalEnd | None = None

    def learn(self, end: SubgoalEnd) -> None:
        """Remember how the last subgoal ended."""
        self._last = end

    def plan(self, observation: Observation, step: int) -> str | None:  # noqa: ARG002
        """Return the stage that is due in words; None when all are completed.

        A policy that reports how subgoals end gets the stage before the due one if the hand has
        lost what the due one handles, or if the environment still publishes the stage before.
        """
        judge = self.env.session.judge
        stage = judge.published
        if not self.reports or stage is None:
            return self.env.subgoal
        index = judge.index
        kind = stage.primitive.kind
        end = self._last
        is_hand_empty = end is not None and (end.how == "missed" or end.why == EMPTY_HAND)
        is_lost = kind in HANDLES_HELD and is_hand_empty
        # A stage is published one step longer than it is due, which counts for waiting only.
        is_published_late = kind != "hold_until" and judge.stages[index] is not stage
        if is_lost or is_published_late:
            index -= 1
        # The environment's own pixel is of what is seen: the arm may hide the object in part.
        return stage_subgoal(self.env, judge.stages, index, grounded=self.grounded)


def stage_subgoal(env: RoboIRGEnv, stages: Sequence[Stage], index: int, *, grounded: bool) -> str:
    """Return a stage as a subgoal in words, with the pixel of its object, and how long to wait.

    For example ``pick up the red cube at <120, 87>``, or ``remain static for 40 steps``.

    Args:
        env: in the state to describe.
        stages: of the goal.
        index: of the stage to name.
        grounded: whether to add the pixel of the stage's object, if it has one and is in view.
    """
    from roboirg.simulation.expert.things import origin_pixel

    stage = stages[index]
    world = env.session.world
    if stage.primitive.kind == "hold_until":
        # A press that follows has to end at a step of its own, so it begins `PRESS_STEPS` earlier.
        until = stage.primitive.steps
        following = stages[index + 1].primitive
        if following.kind == "press_below":
            until = following.steps - PRESS_STEPS
        return f"{stage.subgoal} for {max(until - world.elapsed, 0)} steps"
    if grounded and stage.points_at:
        pixel = origin_pixel(world.bodies[stage.points_at])
        if pixel is not None:
            row, column = pixel
            return stage.subgoal.replace("{at}", f"at <{row}, {column}>")
    return stage.subgoal.replace(" {at}", "")
