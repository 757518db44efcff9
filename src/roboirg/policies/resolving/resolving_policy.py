"""A rewriter and a policy as one policy: resolve what was said, then act."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any, cast

from roboirg.core.actions import Actions
from roboirg.core.episode import Episode, Goal
from roboirg.core.inference_facts import InferenceFacts, inference_facts
from roboirg.core.instruction_options import InstructionOptions
from roboirg.core.observations import Demonstration, Observation
from roboirg.policies.contract.base import AttachedPolicy, Policy, SubgoalEnd, tell_policy
from roboirg.policies.contract.goal_naming import GoalNamer, SaidAndShown
from roboirg.policies.planners.hierarchical_policy import (
    PlannerAndPolicy,
    attach_parts,
    joint_version,
)

if TYPE_CHECKING:
    from roboirg.envs.environment import RoboIRGEnv

BETWEEN = " → "
"""Stands between the versions of a namer and of the policy that hears it."""
RESOLVED = "resolved"
"""Entry of the usage: an episode whose policy heard a rewritten command."""
PASSED_ON = "passed_on"
"""Entry of the usage: an episode whose policy heard what was said."""


class ResolvingPolicy(PlannerAndPolicy, AttachedPolicy):
    """Rewrites what was said as the explicit command of the goal that a namer names.

    ``"The red cubes are my favorite. Put one of them into the bin."`` becomes ``"Put one red cube
    into the bin."``, and the policy hears only that. If the instruction comes in turns, the policy
    hears all utterances but the command as they are, and the rewritten command instead of the last
    one. If the namer names no goal, the policy hears what was said.

    The explicit command is the one that the explicit setting has for the goal in this episode, so
    that a namer that is always right makes of every episode the explicit one.

    Args:
        namer: names the goal.
        policy: hears and acts.
        wordings: whose explicit commands the policy knows: a wording file, ``train`` or ``test``;
            None for those of the episode.

    Attributes:
        needs: of both.
        is_privileged: whether one of them reads the simulator's state. The rewriter itself reads
            the name of the task and the picture that the namer asks for.
    """

    def __init__(self, namer: GoalNamer, policy: Policy, wordings: str | None = None) -> None:
        # The language is imported where it is needed: other policies do without.
        from roboirg.language.scenarios.wording_store import open_wordings

        super().__init__(namer, policy)
        self.namer = namer
        self.policy = policy
        self.is_privileged = hasattr(namer, "attach") or hasattr(policy, "attach")
        self._wordings = open_wordings(wordings)
        self.needs.declare_on(self)
        self._begin("")

    def _begin(self, instruction: str) -> None:
        """Forget the last episode; `instruction` is what is said at the beginning of this one."""
        self._heard = [instruction]
        self._last_words = instruction
        self._goal: Goal | None = None
        self._has_resolved: bool | None = None  # None before the command

    def attach(self, env: RoboIRGEnv) -> None:
        """Receive the environment; the namer and the policy get it if they are privileged."""
        super().attach(env)
        attach_parts(self._all, env)

    def reset(self, instruction: str, demonstration: Demonstration) -> None:
        """Begin an episode; if all has been said, the policy hears the rewritten command.

        The video has the frames that namer or policy need; each of the two gets those of its own.
        """
        self._begin(instruction)
        self._shown = self._frames_for(self._planner_needs, demonstration)
        if not self.env.unheard:
            self._resolve()
        shown_to_policy = self._frames_for(self._policy_needs, demonstration)
        self.policy.reset(self._last_words, shown_to_policy)

    def hear(self, text: str, step: int) -> None:
        """Pass an utterance on to the policy, the last one rewritten."""
        self._heard.append(text)
        self._last_words = text
        if len(self._heard) == len(self.env.instruction.utterances):
            self._resolve()
        tell_policy(self.policy, self._last_words, step)

    def _resolve(self) -> None:
        """Let the namer name the goal, and replace the command, if it names one."""
        env = self.env
        given = SaidAndShown.of(env, " ".join(self._heard), self._shown)
        self._goal = self.namer.name_goal(given)
        self._has_resolved = self._goal is not None
        if self._goal is not None:
            said_wordings = cast("str | None", env.instruction.metadata["wordings"])
            wordings = self._wordings or said_wordings
            self._last_words = explicit_command(env.episode, self._goal, wordings)

    def act(self, observation: Observation) -> Actions:
        """Return the policy's actions; its observation has the words that it has heard last."""
        seen = cast("Observation", {**observation, "instruction": self._last_words})
        return self.policy.act(seen)

    @property
    def version(self) -> str:
        """The versions of both, which the policy may set until its `reset` ends."""
        return rewritten_version(self.namer, self.policy)

    @property
    def metadata(self) -> dict[str, Any]:
        """The words that the policy heard last, the goal that was named, and what both report."""
        reported: dict[str, Any] = {
            "heard": self._last_words,
            "namer": getattr(self.namer, "metadata", {}),
            "policy": getattr(self.policy, "metadata", {}),
        }
        if self._goal is not None:
            reported["understood"] = dict(self._goal.as_mapping())
        return reported

    def usage(self) -> dict[str, float]:
        """Return the costs of both, and whether the command was rewritten or passed on."""
        usage = super().usage()
        if self._has_resolved is not None:
            usage[RESOLVED if self._has_resolved else PASSED_ON] = 1.0
        return usage

    @property
    def subgoal(self) -> str | None:
        """The policy's newest subgoal."""
        return getattr(self.policy, "subgoal", None)

    @property
    def reports(self) -> bool:
        """Whether the policy reports how subgoals end."""
        return bool(getattr(self.policy, "reports", False))

    @property
    def endings(self) -> list[SubgoalEnd]:
        """How subgoals of the policy ended in this episode."""
        return list(getattr(self.policy, "endings", ()))

    @property
    def inference(self) -> InferenceFacts:
        """What the policy computes with."""
        return inference_facts(self.policy)


def explicit_command(episode: Episode, goal: Goal, wordings: str | None) -> str:
    """Return what the explicit setting says of a goal, which the scene need not have.

    Args:
        episode: with the scene.
        goal: of its task.
        wordings: whose words are said, as in `InstructionOptions`.
    """
    from roboirg.language import instruct_with

    explicit = InstructionOptions(wordings=wordings)
    return instruct_with(replace(episode, goal=goal), explicit).text


def rewritten_version(namer: GoalNamer, policy: object) -> str:
    """Return the versions of a namer and of what is behind it as one, ``built-in → v7``."""
    return joint_version(namer, policy, between=BETWEEN)
