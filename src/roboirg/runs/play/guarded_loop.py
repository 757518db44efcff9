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
from roboirg.judging import judge_subgoal, plain_subgoal
from roboirg.policies.contract.base import Policy, PrivilegedPolicy, tell_policy
from roboirg.policies.contract.play import Moment
from roboirg.policies.contract.policy_calls import (
    check_rows,
    policy_metadata,
    policy_subgoal,
    server_version,
)
from roboirg.policies.contract.policy_version import read_version
from roboirg.policies.resolving.resolving_policy import ResolvingPolicy
from roboirg.records.action_log import ActionLog
from roboirg.records.record import Record, SubgoalRecord
from roboirg.runs.job_instruction import PreparedJob
from roboirg.runs.play.call_guard import CallGuard
from roboirg.runs.play.episode_record import conclude_episode, utterances_at
from roboirg.runs.play.goal_outcomes import recorded_events
from roboirg.runs.play.video_writer import VideoWriter

if TYPE_CHECKING:
    from roboirg.envs.environment import RoboIRGEnv

NO_RENDER_DEVICE = "none"
"""Name of the device of an environment that renders nothing."""


class GuardedLoop:
    """Plays a job's episode: the turns of `EpisodeLoop`, guarded and recorded.

    Args:
        env: the environment of the job.
        policy: answers the observations.
        prepared: what is played.
        space: of the policy's actions.
        record: is filled in.
        guard: attributes errors and measures calls.
        writer: gets the frames of a video.

    Attributes:
        start_step: control steps of the world before the policy's turn.
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
        self.env = env
        self.policy = policy
        self._prepared = prepared
        self._space = space
        self._record = record
        self._guard = guard
        self._writer = writer

        ref = prepared.job.ref
        self._is_ours = ref is None or not ref.is_foreign
        # How subgoals end is our hands' to say, not that of a policy of the user's.
        self._has_our_hands = ref is None or not ref.is_foreign or ref.place == "split"
        self._reports_ends = bool(getattr(policy, "reports", False))
        self._noted_ends = 0

        self.start_step = 0
        self._heard: list[Mapping[str, Any]] = []
        self._last_info: dict[str, Any] | None = None
        self.has_begun = False
        self.answers: list[NDArray[np.float64]] = []
        self.log: ActionLog | None = None

    def play(self) -> None:
        """Play the episode from beginning to end."""
        observation, info = self.begin()
        while info["status"] == "ongoing":
            observation, info = self.execute(self.act(observation))
            if info["heard"]:
                self.hear(info["heard"])
        self._last_info = info

    def conclude(self) -> None:
        """Record the verdict of the episode and its reasons; nothing if `play` broke off.

        The record gets outcome and cause from the status at the end, and `conclude_episode` adds
        goals and failure, which it finds in the recorded events and attempts. So call
        `keep_actions`, which records the attempts, before. A status that is no verdict leaves the
        outcome as it was, with a cause that begins with ``environment:``.
        """
        info = self._last_info
        if info is None:
            return
        record = self._record
        if not record.record_status(info["status"], info.get("cause")):
            record.cause = f"environment: the episode ended with status {info['status']!r}"
            return
        conclude_episode(
            record,
            self._prepared,
            self.start_step,
            timed_out=info["status"] == "timeout",
            original=info.get("original"),
        )

    def begin(self) -> Moment:
        """Start the episode and the policy, and record what is known now.

        An error in the first block counts as the environment's, in the second as the policy's.

        Returns:
            The first observation and its info.
        """
        env = self.env
        record = self._record
        with self._guard.environment("env_reset"):
            first_words = SpokenInstruction(env.instruction.turns, record.options.delivery).prompt
            observation, info = self._reset_env(first_words)
            device = str(env.render_device)
            if device != NO_RENDER_DEVICE:
                record.render_device = device
            record.demonstration_steps = len(info["demonstration"]["joint_positions"])
            record.demonstration_source = info["demonstration_source"]
            self.start_step = int(info["elapsed_steps"])
            self._add_events(info)
            self._add_heard(info["heard"])
        with self._guard.policy("policy's reset()", "policy_reset"):
            self.start_policy(first_words, info["demonstration"])
            self._note_version()
            self._read_metadata()
            record.inference = inference_facts(self.policy)
        # Choices are carried out by motions that are planned from the simulator's state.
        if self._space is CHOICE:
            record.ref = dataclasses.replace(record.ref, is_privileged=True)
        self.has_begun = True
        return observation, info

    def _reset_env(self, first_words: str) -> Moment:
        """Start the environment; return the first observation and its info.

        If there is a video, it gets the frames of the demonstration from now on.

        Args:
            first_words: what is said first, shown below the video.
        """
        writer = self._writer
        if writer is None:
            return self.env.reset()
        writer.caption = first_words
        writer.longest_caption = self.env.instruction.text
        self.env.set_frame_hook(writer.add_frame, every=writer.every)
        moment = self.env.reset()
        writer.add_frame(self.env)  # the policy's first observation
        return moment

    def start_policy(self, instruction: str, demonstration: Demonstration) -> None:
        """Start the policy, which gets the world only if its spec declares that.

        So does a rewriter of ours, which hands the world on to nothing that is not privileged.
        """
        may_attach = self._record.ref.is_privileged or isinstance(self.policy, ResolvingPolicy)
        if may_attach and isinstance(self.policy, PrivilegedPolicy):
            self.policy.attach(self.env)
        self.policy.reset(instruction, demonstration)

    def _read_metadata(self) -> None:
        """Record what the policy reports about itself now."""
        metadata = policy_metadata(self.policy, is_ours=self._is_ours)
        self._record.policy_metadata = metadata
        self._record.server_version = server_version(metadata)

    def _add_events(self, info: Mapping[str, Any]) -> None:
        """Record the facts that changed, which the environment reports in its info."""
        self._record.events += recorded_events(info.get("events", ()), self.start_step)

    def _add_heard(self, utterances: Sequence[Mapping[str, Any]]) -> None:
        """Record utterances that the policy now hears."""
        self._heard += utterances
        steps = [int(utterance["step"]) for utterance in self._heard]
        self._record.instruction = utterances_at(self._prepared, steps)

    def _note_version(self) -> None:
        """Record the version of a policy of the user's, which may be set until `reset` ends.

        Raises:
            InvalidValueError: it is no version, or not the one with which the run began.
        """
        ref = self._record.ref
        is_ours = not ref.is_foreign and not ref.is_hosted
        if is_ours:
            return
        version = read_version(self.policy) or ref.version
        if ref.version not in (UNKNOWN_VERSION, version):
            raise InvalidValueError(
                f"the policy's version is {version!r}, but it was {ref.version!r} when the run "
                "began; it must be the same in every process, such as the name of a checkpoint."
            )
        self._record.ref = dataclasses.replace(ref, version=version)

    def act(self, observation: dict[str, Any]) -> NDArray[np.float64]:
        """Return the policy's next actions, (n, size), checked; record the subgoal it names."""
        with self._guard.policy("policy's act()", "policy_act"):
            rows = check_rows(self.policy.act(cast("Observation", observation)), self._space)
            subgoal = policy_subgoal(self.policy)
        with self._guard.environment("env_subgoal"):
            self._note_ends()
            if subgoal is not None:
                self._note_subgoal(subgoal)
        return rows

    def _note_ends(self) -> None:
        """Record how subgoals ended since the last call, as the hands report it.

        The hands are the part of a policy that carries out subgoals of a planner. A subgoal that
        they refuse may be replaced at once, before `act` sees it, so it is recorded here.
        """
        if not self._has_our_hands:
            return
        ends = getattr(self.policy, "endings", ())
        for end in ends[self._noted_ends :]:
            if end.how == "refused":
                self._note_subgoal(end.subgoal)
            subgoals = self._record.subgoals
            if not subgoals:
                continue
            last = subgoals[-1]  # an end belongs to it, or else to an earlier one that was replaced
            if last.text == end.subgoal and last.ended is None:
                ended = replace(last, ended=end.how, why=end.why or None, thing=end.thing)
                self._record.subgoals = (*subgoals[:-1], ended)
        self._noted_ends = len(ends)

    def _note_subgoal(self, subgoal: str) -> None:
        """Record a subgoal of a planner, and whether it is what is due now.

        Nothing is recorded if the subgoal is the last one that was, and still goes on.

        Args:
            subgoal: in words, perhaps with a point in the front picture.
        """
        stage = self.env.due_stage
        due = None if stage is None else plain_subgoal(stage)
        if self._is_noted(subgoal, due):
            return
        _, point = split_point(subgoal)
        if self._writer is not None:
            self._writer.point = point
        pointed_at = None if point is None else self.env.objects_at(point)
        facts = self.env.session.world.facts
        verdict = judge_subgoal(subgoal, stage, pointed_at, self.env.episode, facts)
        noted = SubgoalRecord(
            step=self._record.steps, text=subgoal, point=point, due=due, verdict=verdict
        )
        self._record.subgoals += (noted,)

    def _is_noted(self, subgoal: str, due: str | None) -> bool:
        """Return whether a subgoal is the last one that was recorded, and still goes on.

        It does not go on if another stage is due, or if it has failed and is tried again. Where the
        hands report how subgoals end, it goes on in any case until they do.

        Args:
            subgoal: in words.
            due: the stage that is due, in words; None without one.
        """
        if not self._record.subgoals:
            return False
        last = self._record.subgoals[-1]
        if last.text != subgoal:
            return False
        if self._reports_ends and last.ended is None:
            return True  # it is still being done
        return last.due == due and last.ended not in ("missed", "blocked", "time-out")

    def execute(self, actions: ArrayLike) -> Moment:
        """Execute actions until the episode ends, and keep those that were executed.

        Args:
            actions: (n, size).

        Returns:
            The observation after them and its info.
        """
        rows = np.asarray(actions)
        with self._guard.environment("env_step"):
            executed_before = self.env.executed_actions
            observation, *_, info = self.env.step_chunk(rows)
            executed = self.env.executed_actions - executed_before
            self.answers.append(rows[:executed])
        record = self._record
        record.steps = int(info["steps"])
        record.calls = len(self.answers)
        record.executed = max(record.executed, len(self.answers[-1]))
        self._add_events(info)
        return observation, info

    def hear(self, utterances: Sequence[Mapping[str, Any]]) -> None:
        """Pass new utterances on to the policy, record them, and show them below the video."""
        self._add_heard(utterances)
        if self._writer is not None:
            self._writer.caption = " ".join(utterance["text"] for utterance in self._heard)
        with self._guard.policy("policy's hear()", "policy_hear"):
            for utterance in utterances:
                tell_policy(self.policy, utterance["text"], utterance["step"])
            self._read_metadata()

    def keep_actions(self) -> None:
        """Make the log of the executed actions, and record the hash of the world's end state.

        The log has all actions in one array, (n, size), and the index at which each answer of the
        policy begins. Attempts, which the environment knows only at the end, are recorded, too.
        """
        numbers, state_hash = self.env.end_state()
        self._record.end_state = state_hash
        attempts = [attempt.as_dict() for attempt in self.env.attempts]
        self._record.attempts = recorded_events(attempts, self.start_step)

        first_rows = []
        count = 0
        for answer in self.answers:
            first_rows.append(count)
            count += len(answer)
        no_rows = np.empty((0, self._space.size))
        rows = np.concatenate([no_rows, *self.answers])
        starts = np.array(first_rows, dtype=np.int32)
        self.log = ActionLog(self._space.name, rows, starts, numbers)
