"""The loop of a rollout: guarded calls that fill the result and the video."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, cast

import numpy as np
from msgspec.structs import replace
from numpy.typing import ArrayLike, NDArray

from roboirg.core.actions import ActionSpace
from roboirg.core.delivery import SpokenInstruction
from roboirg.core.inference_facts import inference_facts
from roboirg.core.observations import Demonstration, Observation
from roboirg.core.subgoal_text import split_point
from roboirg.evaluation.play.call_guard import CallGuard
from roboirg.evaluation.play.rollout_result import RolloutResult
from roboirg.evaluation.play.video_writer import VideoWriter
from roboirg.evaluation.policy_calls import check_rows, policy_metadata, policy_subgoal
from roboirg.evaluation.records.record import Job, SubgoalRecord
from roboirg.judging import judge_subgoal, plain_subgoal
from roboirg.policies.by_name.loading import is_foreign, is_privileged, planner_alone
from roboirg.policies.contract.base import Policy
from roboirg.policies.contract.play import EpisodeLoop

if TYPE_CHECKING:
    from roboirg.envs.environment import RoboIRGEnv

NO_RENDER_DEVICE = "none"
"""Name of the device of an environment that renders nothing."""


class GuardedLoop(EpisodeLoop):
    """Plays a job's episode.

    Args:
        env: the environment of the job.
        policy: answers the observations.
        job: what is played.
        space: of the policy's actions.
        result: is filled in.
        guard: attributes errors and measures calls.
        writer: gets the frames of a video.
    """

    def __init__(
        self,
        env: RoboIRGEnv,
        policy: Policy,
        job: Job,
        space: ActionSpace,
        result: RolloutResult,
        guard: CallGuard,
        writer: VideoWriter | None = None,
    ) -> None:
        super().__init__(env, policy)
        self._job, self._space, self._writer = job, space, writer
        self._result, self._guard = result, guard
        self._is_ours = not is_foreign(job.policy_spec)
        self._knows_ends = self._is_ours or planner_alone(job.policy_spec) is not None
        self._reports, self._ends = bool(getattr(policy, "reports", False)), 0

    def play(self) -> dict[str, Any]:
        """Play the episode, and record its status."""
        info, result = super().play(), self._result
        limit = self._job.environment.max_steps
        if not result.record_status(info["status"], info.get("cause"), limit):
            result.cause = f"environment: the episode ended with status {info['status']!r}"
        return info

    def begin(self) -> tuple[dict[str, Any], dict[str, Any]]:
        """Start the episode and the policy."""
        env, result, writer = self.env, self._result, self._writer
        with self._guard.environment("env_reset"):
            result.instruction = env.instruction
            first = SpokenInstruction(env.instruction.turns, self._job.options.delivery).prompt
            if writer is not None:
                writer.caption, writer.longest_caption = first, env.instruction.text
                env.set_frame_hook(writer.add_frame, every=writer.every)
            observation, info = env.reset()
            if writer is not None:
                writer.add_frame(env)  # the policy's first observation
            device = str(env.render_device)
            result.render_device = None if device == NO_RENDER_DEVICE else device
            result.demonstration_steps = len(info["demonstration"]["joint_positions"])
            result.demonstration_source = info["demonstration_source"]
            result.policy_start_step = int(info["elapsed_steps"])
            result.add_events(info)
            result.heard += info["heard"]
        with self._guard.policy("policy's reset()", "policy_reset"):
            self.start_policy(first, info["demonstration"])
            result.policy_metadata = policy_metadata(self.policy, is_ours=self._is_ours)
            result.inference = inference_facts(self.policy)
        result.action_space = self._space.name
        return observation, info

    def start_policy(self, instruction: str, demonstration: Demonstration) -> None:
        """Start the policy, which gets the world only if its spec declares that."""
        if is_privileged(self._job.policy_spec):
            super().start_policy(instruction, demonstration)
        else:
            self.policy.reset(instruction, demonstration)

    def act(self, observation: dict[str, Any]) -> NDArray[np.float64]:
        """Return the policy's next actions, checked."""
        with self._guard.policy("policy's act()", "policy_act"):
            rows = check_rows(self.policy.act(cast("Observation", observation)), self._space)
            subgoal = policy_subgoal(self.policy)
        with self._guard.environment("env_subgoal"):
            self._note_ends()
            if subgoal is not None:
                self._note_subgoal(subgoal)
        return rows

    def _note_ends(self) -> None:
        """Keep how subgoals ended, and those that were refused meanwhile."""
        ends = getattr(self.policy, "endings", ()) if self._knows_ends else ()
        for end in ends[self._ends :]:
            found = self._result.subgoals
            if end.how == "refused":
                self._note_subgoal(end.subgoal)
            if found and found[-1].text == end.subgoal and found[-1].ended is None:
                found[-1] = replace(found[-1], ended=end.how, why=end.why or None, thing=end.thing)
        self._ends = len(ends)

    def _note_subgoal(self, subgoal: str) -> None:
        """Keep a subgoal if it or the stage that is due is new."""
        stage, found = self.env.due_stage, self._result.subgoals
        due = None if stage is None else plain_subgoal(stage)
        if found and self._reports and found[-1].text == subgoal and found[-1].ended is None:
            return  # it is still being done
        tries_again = found and found[-1].ended in ("missed", "blocked", "time-out")
        if found and not tries_again and (found[-1].text, found[-1].due) == (subgoal, due):
            return
        _, point = split_point(subgoal)
        if self._writer is not None:
            self._writer.point = point
        verdict = judge_subgoal(subgoal, stage, self.env.objects_at(point) if point else None)
        found.append(
            SubgoalRecord(
                step=self._result.steps, text=subgoal, point=point, due=due, verdict=verdict
            )
        )

    def execute(self, actions: ArrayLike) -> tuple[dict[str, Any], dict[str, Any]]:
        """Execute actions, and keep those that were executed."""
        rows, result = np.asarray(actions), self._result
        with self._guard.environment("env_step"):
            done = self.env.executed_actions
            observation, info = super().execute(rows)
            result.answers.append(rows[: self.env.executed_actions - done])
        result.steps = int(info["steps"])
        result.add_events(info)
        return observation, info

    def hear(self, utterances: Sequence[Mapping[str, Any]]) -> None:
        """Let the policy hear what has just been said, and write it under the video."""
        self._result.heard += utterances
        if self._writer is not None:
            self._writer.caption = " ".join(one["text"] for one in self._result.heard)
        with self._guard.policy("policy's hear()", "policy_hear"):
            super().hear(utterances)
            self._result.policy_metadata = policy_metadata(self.policy, is_ours=self._is_ours)
