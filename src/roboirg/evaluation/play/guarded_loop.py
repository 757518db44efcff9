"""The loop of a rollout: guarded calls that fill the record and the video."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, cast

import numpy as np
from msgspec.structs import replace
from numpy.typing import ArrayLike, NDArray

from roboirg.core.actions import CHOICE, ActionSpace
from roboirg.core.delivery import SpokenInstruction
from roboirg.core.errors import InvalidValueError
from roboirg.core.inference_facts import inference_facts
from roboirg.core.observations import Demonstration, Observation
from roboirg.core.policy_ref import UNKNOWN_VERSION
from roboirg.core.subgoal_text import split_point
from roboirg.evaluation.play.call_guard import CallGuard
from roboirg.evaluation.play.episode_record import conclude, utterances_at
from roboirg.evaluation.play.goal_outcomes import recorded_events
from roboirg.evaluation.play.job_instruction import PreparedJob
from roboirg.evaluation.play.video_writer import VideoWriter
from roboirg.evaluation.records.action_log import ActionLog
from roboirg.evaluation.records.record import Record, SubgoalRecord
from roboirg.judging import judge_subgoal, plain_subgoal
from roboirg.policies.contract.base import Policy
from roboirg.policies.contract.play import EpisodeLoop, Moment
from roboirg.policies.contract.policy_calls import (
    check_rows,
    policy_metadata,
    policy_subgoal,
    server_version,
)
from roboirg.policies.contract.policy_version import read_version

if TYPE_CHECKING:
    from roboirg.envs.environment import RoboIRGEnv

NO_RENDER_DEVICE = "none"
"""Name of the device of an environment that renders nothing."""


class GuardedLoop(EpisodeLoop):
    """Plays a job's episode.

    Args:
        env: the environment of the job.
        policy: answers the observations.
        prepared: what is played.
        space: of the policy's actions.
        record: is filled in.
        guard: attributes errors and measures calls.
        writer: gets the frames of a video.

    Attributes:
        has_begun: whether the policy's turn came.
        answers: what was executed of each answer of the policy, (n, size).
        log: the executed actions; None if the policy's turn never came, or the world broke.
    """

    def __init__(
        self,
        env: RoboIRGEnv,
        policy: Policy,
        prepared: PreparedJob,
        space: ActionSpace,
        record: Record,
        guard: CallGuard,
        writer: VideoWriter | None = None,
    ) -> None:
        super().__init__(env, policy)
        self._prepared, self._space, self._writer = prepared, space, writer
        self._record, self._guard = record, guard
        ref = prepared.job.ref
        self._is_ours = ref is None or not ref.is_foreign
        self._knows_ends = ref is None or not ref.is_foreign or ref.place == "split"
        self._reports, self._ends = bool(getattr(policy, "reports", False)), 0
        self._start, self._heard = 0, list[Mapping[str, Any]]()
        self.has_begun, self.answers = False, list[NDArray[np.float64]]()
        self._last: dict[str, Any] | None = None
        self.log: ActionLog | None = None

    def play(self) -> dict[str, Any]:
        """Play the episode from beginning to end. Returns the last step's info."""
        self._last = super().play()
        return self._last

    def conclude(self) -> None:
        """Record how the episode ended and why, if it came to its end."""
        if (info := self._last) is None:
            return
        record = self._record
        if not record.record_status(info["status"], info.get("cause")):
            record.cause = f"environment: the episode ended with status {info['status']!r}"
            return
        timed_out, original = info["status"] == "timeout", info.get("original")
        conclude(record, self._prepared, self._start, timed_out=timed_out, original=original)

    def begin(self) -> Moment:
        """Start the episode and the policy."""
        env, record, writer = self.env, self._record, self._writer
        with self._guard.environment("env_reset"):
            first = SpokenInstruction(env.instruction.turns, record.options.delivery).prompt
            if writer is not None:
                writer.caption, writer.longest_caption = first, env.instruction.text
                env.set_frame_hook(writer.add_frame, every=writer.every)
            observation, info = env.reset()
            if writer is not None:
                writer.add_frame(env)  # the policy's first observation
            device = str(env.render_device)
            record.render_device = None if device == NO_RENDER_DEVICE else device
            record.demonstration_steps = len(info["demonstration"]["joint_positions"])
            record.demonstration_source = info["demonstration_source"]
            self._start = int(info["elapsed_steps"])
            self._add_events(info)
            self._add_heard(info["heard"])
        with self._guard.policy("policy's reset()", "policy_reset"):
            self.start_policy(first, info["demonstration"])
            self._note_version()
            self._read_metadata()
            record.inference = inference_facts(self.policy)
        if self._space is CHOICE:
            record.ref = dataclasses.replace(record.ref, is_privileged=True)
        self.has_begun = True
        return observation, info

    def start_policy(self, instruction: str, demonstration: Demonstration) -> None:
        """Start the policy, which gets the world only if its spec declares that."""
        if self._record.ref.is_privileged:
            super().start_policy(instruction, demonstration)
        else:
            self.policy.reset(instruction, demonstration)

    def _read_metadata(self) -> None:
        found = policy_metadata(self.policy, is_ours=self._is_ours)
        self._record.policy_metadata, self._record.server_version = found, server_version(found)

    def _add_events(self, info: Mapping[str, Any]) -> None:
        self._record.events += recorded_events(info.get("events", ()), self._start)

    def _add_heard(self, utterances: Sequence[Mapping[str, Any]]) -> None:
        self._heard += utterances
        steps = [int(one["step"]) for one in self._heard]
        self._record.instruction = utterances_at(self._prepared, steps)

    def _note_version(self) -> None:
        """Keep the version that a policy of the user's declares now that its `reset` has ended.

        Raises:
            InvalidValueError: it is no version, or not the one with which the run began.
        """
        ref = self._record.ref
        if not (ref.is_foreign or ref.is_hosted):
            return
        version = read_version(self.policy) or ref.version
        if ref.version not in (UNKNOWN_VERSION, version):
            raise InvalidValueError(
                f"the policy's version is {version!r}, but it was {ref.version!r} when the run "
                "began; it must be the same in every process, such as the name of a checkpoint."
            )
        self._record.ref = dataclasses.replace(ref, version=version)

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
            if end.how == "refused":
                self._note_subgoal(end.subgoal)
            *before, last = self._record.subgoals or (None,)
            if last is not None and last.text == end.subgoal and last.ended is None:
                ended = replace(last, ended=end.how, why=end.why or None, thing=end.thing)
                self._record.subgoals = (*before, ended)
        self._ends = len(ends)

    def _note_subgoal(self, subgoal: str) -> None:
        """Keep a subgoal if it or the stage that is due is new."""
        stage, found = self.env.due_stage, self._record.subgoals
        due = None if stage is None else plain_subgoal(stage)
        if found and self._reports and found[-1].text == subgoal and found[-1].ended is None:
            return  # it is still being done
        tries_again = found and found[-1].ended in ("missed", "blocked", "time-out")
        if found and not tries_again and (found[-1].text, found[-1].due) == (subgoal, due):
            return
        _, point = split_point(subgoal)
        if self._writer is not None:
            self._writer.point = point
        pointed_at = self.env.objects_at(point) if point else None
        facts = self.env.session.world.facts
        verdict = judge_subgoal(subgoal, stage, pointed_at, self.env.episode, facts)
        self._record.subgoals += (
            SubgoalRecord(
                step=self._record.steps, text=subgoal, point=point, due=due, verdict=verdict
            ),
        )

    def execute(self, actions: ArrayLike) -> Moment:
        """Execute actions, and keep those that were executed."""
        rows, record = np.asarray(actions), self._record
        with self._guard.environment("env_step"):
            done = self.env.executed_actions
            observation, info = super().execute(rows)
            self.answers.append(rows[: self.env.executed_actions - done])
        record.steps, record.calls = int(info["steps"]), len(self.answers)
        record.executed = max(record.executed, len(self.answers[-1]))
        self._add_events(info)
        return observation, info

    def hear(self, utterances: Sequence[Mapping[str, Any]]) -> None:
        """Let the policy hear what has just been said, and write it under the video."""
        self._add_heard(utterances)
        if self._writer is not None:
            self._writer.caption = " ".join(one["text"] for one in self._heard)
        with self._guard.policy("policy's hear()", "policy_hear"):
            super().hear(utterances)
            self._read_metadata()

    def keep_actions(self) -> None:
        """Keep the executed actions and where they left the world; record its hash and attempts."""
        numbers, self._record.end_state = self.env.end_state()
        tried = [one.as_dict() for one in self.env.attempts]
        self._record.attempts = recorded_events(tried, self._start)
        starts = np.cumsum([0, *map(len, self.answers)], dtype=np.int32)[:-1]
        rows = np.concatenate([np.empty((0, self._space.size)), *self.answers])
        self.log = ActionLog(self._space.name, rows, starts, numbers)
