"""The planner that understands the words by a rule, and names the stages of the goal in order."""

from __future__ import annotations

import pkgutil
from typing import TYPE_CHECKING

from roboirg.core.episode import HANDLES_HELD
from roboirg.core.observations import Demonstration, Observation
from roboirg.policies.builtin import BUILTIN
from roboirg.policies.builtin.scripted import MAX_RETRIES, ScriptedPolicy, completed_stages
from roboirg.policies.contract.base import SubgoalEnd
from roboirg.policies.planners.oracle_planner import OraclePlanner, stage_subgoal
from roboirg.policies.planners.planner import SubgoalOptions

if TYPE_CHECKING:
    from roboirg.envs.environment import RoboIRGEnv


class GoalPlanner(OraclePlanner):
    """Names the stages of the goal that a built-in policy decides on. Privileged.

    The next one follows when the last is done; one without effect is repeated. If the policy that
    follows does not report how subgoals end, it sees in the simulator what is completed.

    It knows the task and the scene, but not the goal. Where the rule gives no goal of the scene,
    and before everything has been said, it names nothing.

    Args:
        options: whether subgoals have pixels.
        kind: name of the built-in policy, such as ``listener``, that decides on the goal.
        seed: of its random choices.
    """

    def __init__(
        self, options: SubgoalOptions | None = None, kind: str = "listener", seed: int = 0
    ) -> None:
        super().__init__(options, kind)
        self.grounded = False  # it reads the pixels itself
        self._decider: ScriptedPolicy = pkgutil.resolve_name(BUILTIN[kind])(seed)

    def attach(self, env: RoboIRGEnv) -> None:
        """Receive the environment."""
        super().attach(env)
        self._decider.attach(env)

    def reset(self, instruction: str, demonstration: Demonstration) -> None:
        """Begin an episode; decide on a goal if everything has been said."""
        self._index = 0  # of the stage to name
        self._retries = 0
        self._since: int | None = None  # control step of the world from which on facts count
        self._decider.reset(instruction, demonstration)

    def hear(self, text: str, step: int) -> None:
        """Remember an utterance, and decide on a goal if it was the last one."""
        self._decider.hear(text, step)

    def learn(self, end: SubgoalEnd) -> None:
        """Go on to the next stage if the last one was done, or repeat it if it had no effect.

        A stage that was refused, or failed after `MAX_RETRIES` retries in all, ends the planning.
        """
        stages = self._decider.stages
        if end.how == "done":
            self._index += 1
        elif end.how != "refused" and self._retries < MAX_RETRIES:
            self._retries += 1
            # A stage that handles what is held needs it picked up again, in the stage before.
            if stages[self._index].primitive.kind in HANDLES_HELD and self._index > 0:
                self._index -= 1
        else:
            self._index = len(stages)

    def plan(self, observation: Observation, step: int) -> str | None:  # noqa: ARG002
        """Return the stage to do in words, as things are now; None after the last or for no goal.

        Without reports of how subgoals end, the simulator shows how many stages are completed.
        """
        stages = self._decider.stages
        if stages and not self.reports:
            if self._since is None:
                self._since = self.env.session.world.elapsed
            self._index = completed_stages(self.env, stages, self._since)
        if self._index >= len(stages):
            return None
        is_grounded = self.options.subgoals == "grounded"
        return stage_subgoal(self.env, stages, self._index, grounded=is_grounded)
