"""Planners that know the task's own order of subgoals, and understand the words by a rule."""

from __future__ import annotations

import pkgutil
from collections.abc import Sequence

from roboirg.core.episode import HANDLES_HELD, Stage
from roboirg.core.observations import Demonstration, Observation
from roboirg.policies.builtin import BUILTIN
from roboirg.policies.builtin.scripted import ScriptedPolicy, StageProgress
from roboirg.policies.contract.base import SubgoalEnd
from roboirg.policies.planners.oracle_planner import OracleOptions, OraclePlanner, stage_subgoal
from roboirg.tasks import get_task

MAX_RETRIES = 3
"""Repetitions per episode of subgoals that came to nothing."""


class GoalPlanner(OraclePlanner):
    """Names the stages of the goal that it understands, one when the last is done. Privileged.

    Of hands that do not report how subgoals end, it sees in the world what is completed.

    Words are its only skill: it knows the task and the scene, but not the goal. Where the rule
    gives no goal of the scene, and before everything has been said, it names nothing.
    """

    def __init__(
        self, options: OracleOptions | None = None, kind: str = "listener", seed: int = 0
    ) -> None:
        super().__init__(options, kind)
        self.grounded = False  # it reads the pixels itself
        name = "listener" if kind == "fixed" else kind
        decider: type[ScriptedPolicy] = pkgutil.resolve_name(BUILTIN[name])
        self._decider = decider(seed)
        self._heard: list[str] = []
        self._stages: Sequence[Stage] | None = None
        self._progress: StageProgress | None = None
        self._index = self._retries = 0

    def reset(self, instruction: str, demonstration: Demonstration) -> None:
        """Begin an episode; decide on a goal if everything has been said."""
        super().reset(instruction, demonstration)
        self._heard, self._stages = [instruction], None
        self._index = self._retries = 0
        self._progress = None
        if not self.env.unheard:
            self._decide()

    def hear(self, text: str, step: int) -> None:  # noqa: ARG002
        """Remember an utterance, and decide on a goal after the last one."""
        self._heard.append(text)
        if len(self._heard) == len(self.env.instruction.utterances):
            self._decide()

    def learn(self, end: SubgoalEnd) -> None:
        """Go on to the next stage, or repeat one that came to nothing."""
        if end.how == "done":
            self._index += 1
        elif end.how != "refused" and self._retries < MAX_RETRIES:
            self._retries += 1
            stage = (self._stages or ())[self._index]
            self._index -= stage.primitive.kind in HANDLES_HELD and self._index > 0
        else:
            self._stages = ()

    def plan(self, observation: Observation, step: int) -> str | None:  # noqa: ARG002
        """Return the next stage in words; None after the last."""
        stages = self._stages or ()
        if self._progress is not None and not self.reports:
            self._index = self._progress.completed()
        if self._index >= len(stages):
            return None
        return self.describe(stages, self._index)

    def describe(self, stages: Sequence[Stage], index: int) -> str:
        """Return a stage as a subgoal, as things are now."""
        grounded = self.options.subgoals == "grounded"
        return stage_subgoal(self.env, stages, index, grounded=grounded)

    def _decide(self) -> None:
        env = self.env
        goal = self._decider.decide(env, " ".join(self._heard))
        stages = () if goal is None else get_task(env.episode.task).stages(env.episode.scene, goal)
        self.begin(stages)

    def begin(self, stages: Sequence[Stage]) -> None:
        """Begin the plan of a goal."""
        self._stages = stages
        self._progress = StageProgress(self.env, tuple(stages)) if stages else None


class FixedPlanner(GoalPlanner):
    """Makes the listener's plan at the start, and never looks again: what fails is not repeated."""

    def __init__(
        self, options: OracleOptions | None = None, kind: str = "fixed", seed: int = 0
    ) -> None:
        super().__init__(options, kind, seed)
        self._plan: list[str] = []

    def begin(self, stages: Sequence[Stage]) -> None:
        """Write the plan, with things where they are at the start."""
        super().begin(stages)
        self._plan = [self.describe(stages, index) for index in range(len(stages))]

    def learn(self, end: SubgoalEnd) -> None:  # noqa: ARG002
        """Go on, however the last subgoal ended."""
        self._index += 1

    def plan(self, observation: Observation, step: int) -> str | None:  # noqa: ARG002
        """Return the next subgoal of the plan; None after the last."""
        if self._stages is None or self._index >= len(self._plan):
            return None
        return self._plan[self._index]
