"""Play one job and return its record.

| what goes wrong | outcome | kind of error |
| --- | --- | --- |
| the policy breaks the task's rules or runs out of steps | failure | |
| the policy raises or calls `sys.exit` | error | policy |
| the policy's action cannot be executed | error | invalid_action |
| the policy's server answers too late or not at all | error | timeout, connection |
| the environment or the demonstration raises | error | environment |
| the instruction is too long for the policy, and such episodes are refused | error | prompt |
| no Vulkan device, a missing dependency | none: the run stops | |
| a video cannot be written, a policy cannot report its costs | unchanged | |
"""

from __future__ import annotations

import contextlib
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from socket import socket
from typing import NamedTuple

from roboirg.core.error_words import one_line
from roboirg.core.errors import InvalidValueError
from roboirg.core.policy_needs import PolicyNeeds
from roboirg.core.policy_ref import SCRIPTED, PolicyRef
from roboirg.policies.by_name.finding import follower_of, make_policy, rewriting_in
from roboirg.policies.by_name.policy_kinds import make_follower, put_behind
from roboirg.policies.contract.base import Policy, close_policy
from roboirg.policies.contract.policy_calls import GUESSED, policy_usage
from roboirg.policies.planners.hierarchical_policy import HierarchicalPolicy
from roboirg.policies.prompt_length.prompt_audit import PromptLimit
from roboirg.policies.prompt_length.tokenizer_file import prompt_limit
from roboirg.policies.resolving.resolving_policy import ResolvingPolicy
from roboirg.policies.vlm.models.reply_store import ReplySettings, use_replies
from roboirg.records.action_log import ActionLog, write_actions
from roboirg.records.film import VIDEO_FOLDER, VideoMode
from roboirg.records.record import Job, Record
from roboirg.runs.episode_errors import EpisodeError, EpisodeLostError
from roboirg.runs.hosting.host_pool import HostSettings
from roboirg.runs.hosting.hosted_policy import HostedPlanner, HostedPolicy
from roboirg.runs.job_instruction import PreparedJob, episode_policy_seed
from roboirg.runs.play.call_guard import CallGuard
from roboirg.runs.play.episode_record import (
    audit_record,
    begin_record,
    lost_record,
    utc_now,
)
from roboirg.runs.play.guarded_loop import GuardedLoop
from roboirg.runs.play.policy_environment import job_needs, make_env
from roboirg.runs.play.prompt_shares import check_prompt
from roboirg.runs.play.video_writer import VideoWriter

PlayJob = Callable[[Job], Record]
"""Function that plays one job. Executors send it to other processes, so it must be picklable."""

MAX_LOSSES = 20
"""How often an episode is played again because other episodes broke the policy's process."""


class PlayedJob(NamedTuple):
    """What is left of an episode that was played.

    Attributes:
        record: how it went.
        log: the actions, which are not stored yet; None if the policy's turn never came, or the
            world broke.
    """

    record: Record
    log: ActionLog | None = None


@dataclass(frozen=True, slots=True)
class EpisodeRunner:
    """Plays jobs with the simulator and real policies.

    Attributes:
        folder: output folder of the run; videos go to ``videos/`` in it.
        video: which episodes get a video.
        policy_timeout_s: seconds that one call of the policy may take, if a supervisor watches.
        plan: fingerprint of the plan, for the records.
        hosting: how policies get processes of their own; None for policies in the world's process.
        hosts: the line on which to ask for them; an executor sets it.
        refuse_long: whether an episode is not played if its prompt is longer than what the policy's
            model reads.
        replies: where those of models are kept; None for a run that keeps none.
    """

    folder: Path
    video: VideoMode = "off"
    policy_timeout_s: float | None = None
    plan: str | None = None
    hosting: HostSettings | None = None
    hosts: socket | None = None
    refuse_long: bool = False
    replies: ReplySettings | None = None

    def in_folder(self, folder: Path) -> EpisodeRunner:
        """Return a copy that writes its videos and the replies of models to another folder."""
        replies = None if self.replies is None else self.replies._replace(folder=folder)
        return replace(self, folder=folder, replies=replies)

    def __call__(self, job: Job) -> Record:
        """Play one job.

        Raises:
            EndOfRunError: no Vulkan device can render, a package has to be installed first, ….
        """
        started_at = utc_now()
        start = time.monotonic()
        writer = None
        if self.video != "off":
            writer = VideoWriter(self.folder / VIDEO_FOLDER / f"{job.slug}.mp4")
        with use_replies(self.replies, job.slug):
            played = self._play(job, writer)
        record = played.record
        if writer is not None:
            self._finish_video(writer, record)
        if played.log is not None:
            record.action_log = write_actions(played.log, self.folder)
        record.started_at = started_at
        record.plan = self.plan
        record.duration_s = round(time.monotonic() - start, 3)
        return record

    def _play(self, job: Job, writer: VideoWriter | None) -> PlayedJob:
        """Play a job, and again from its beginning if the policy's process is lost meanwhile.

        After `MAX_LOSSES` losses it ends with an error. If the process was lost in a call about a
        batch of episodes, this one is not put into a batch again.

        Args:
            job: what to play.
            writer: gets the frames of a video; None for no video.
        """
        is_alone = False
        attempt = 1
        while True:
            try:
                played = self.play_once(job, writer, alone=is_alone)
                break
            except EpisodeLostError as error:
                if attempt == MAX_LOSSES:
                    message = f"{error}, {attempt} times in a row"
                    played = PlayedJob(lost_record(job, error.kind, message))
                    break
                is_alone = is_alone or error.alone
            if writer is not None:
                writer.discard()
            attempt += 1
        played.record.attempt = attempt
        return played

    def play_once(
        self, job: Job, writer: VideoWriter | None = None, *, alone: bool = False
    ) -> PlayedJob:
        """Play one job once; return its record and actions.

        Errors of the policy or the environment end up in the record.

        Args:
            job: what to play.
            writer: gets the frames of a video.
            alone: whether a hosted policy must not be asked about it together with others.

        Raises:
            EpisodeLostError: the policy's process was lost; the episode can be played again.
            RenderDeviceError: no Vulkan device can render.
            MissingDependencyError: a package has to be installed first.
            InvalidValueError: the job's wording file is missing or has changed.
        """
        prepared = PreparedJob(job)
        # A policy of the user's plays in a process of its own (is hosted), one of roboirg in this.
        hosts = self.hosts if job.ref is not None and job.ref.is_hosted else None
        record = begin_record(prepared)
        guard = CallGuard(record.timings, self.policy_timeout_s, is_hosted=hosts is not None)
        limit: PromptLimit | None = None
        loop: GuardedLoop | None = None
        with contextlib.ExitStack() as closing:
            try:
                with guard.policy("policy's constructor", "policy_load"):
                    policy = self._load(prepared, hosts, alone=alone)
                    closing.callback(_close_policy, policy, record, guard)
                    needs = job_needs(policy, job)
                    limit = prompt_limit(needs)
                    # Refused before the episode is played, as the outcome would mean nothing.
                    if self.refuse_long and limit is not None:
                        check_prompt(job, limit, prepared.words.instruction)
                loop = play_with(policy, prepared, needs, record, guard, writer)
            except EpisodeError as error:
                record.record_error(error.kind, error.cause, error.details)

        if limit is not None:
            with contextlib.suppress(InvalidValueError):
                audit_record(record, prepared, limit)
        if loop is None:
            return PlayedJob(record)
        loop.conclude()
        return PlayedJob(record, loop.log)

    def _load(self, prepared: PreparedJob, hosts: socket | None, *, alone: bool) -> Policy:
        """Make the policy of a job, in a process of its own if `hosts` leads to one."""
        if hosts is None:
            return load_policy(prepared)
        seed = _seed_of(prepared)
        return _hosted(hosts, _policy_of(prepared), seed, self.policy_timeout_s, alone=alone)

    def _finish_video(self, writer: VideoWriter, record: Record) -> None:
        """Complete the video, or discard an unwanted one; record its path, and what failed."""
        is_wanted = self.video == "all" or record.outcome != "success"
        if is_wanted and writer.finish():
            record.video = writer.path.relative_to(self.folder).as_posix()
        else:
            writer.discard()
        record.video_error = None if writer.error is None else one_line(writer.error)


def play_with(
    policy: Policy,
    prepared: PreparedJob,
    needs: PolicyNeeds,
    record: Record,
    guard: CallGuard,
    writer: VideoWriter | None = None,
) -> GuardedLoop:
    """Play one job with a loaded policy, and fill in the record; errors end up in it, too.

    The policy is not closed, and the end of the episode is not recorded yet.

    Args:
        policy: answers the observations.
        prepared: what to play.
        needs: what the environment offers.
        record: is filled in.
        guard: attributes errors and measures calls.
        writer: gets the frames of a video.

    Returns:
        What was played; `GuardedLoop.conclude` records how it ended.

    Raises:
        EpisodeError: the environment cannot be made, or its last state cannot be read.
    """
    with guard.environment("env_reset"):
        env = make_env(prepared, needs)
        record.needs = needs.declared
    with contextlib.closing(env):
        loop = GuardedLoop(env, policy, prepared, needs.action_space, record, guard, writer)
        try:
            loop.play()
        except EpisodeError as error:
            record.record_error(error.kind, error.cause, error.details)
            if error.kind == "environment":  # its last state cannot be trusted
                return loop
        if loop.has_begun:
            with guard.environment("env_step"):
                loop.keep_actions()
        return loop


def load_policy(prepared: PreparedJob) -> Policy:
    """Return a new policy object, so that no state of an earlier episode remains."""
    return make_policy(_policy_of(prepared), _seed_of(prepared))


def _hosted(
    hosts: socket, ref: PolicyRef, seed: int, limit_s: float | None, *, alone: bool
) -> HostedPolicy | HierarchicalPolicy | ResolvingPolicy:
    """Return a policy of the user's, whose code runs in a process of its own.

    If a user's planner names subgoals for our scripted hands, only the planner is in that process:
    the hands need the simulator, which is in this one. So does a rewriter before the policy.

    Args:
        hosts: the line on which to ask for the process.
        ref: the policy.
        seed: of its random choices.
        limit_s: seconds that one call may take.
        alone: whether it must not be asked about this episode together with others.
    """
    if ref.place == "split":
        planner = HostedPlanner(hosts, ref.hosted_part, seed, limit_s, alone=alone)
        hands = make_follower(SCRIPTED, seed)
        return HierarchicalPolicy(planner, hands, f"{ref.kind}:{ref.target}")
    if ref.place == "behind":
        follower = _hosted(hosts, follower_of(ref), seed, limit_s, alone=alone)
        return put_behind(rewriting_in(ref), follower, seed)
    return HostedPolicy(hosts, ref, seed, limit_s, alone=alone)


def _policy_of(prepared: PreparedJob) -> PolicyRef:
    """Return the policy that plays a job; raise if the job names none."""
    ref = prepared.job.ref
    if ref is None:
        raise ValueError(f"{prepared.job.slug} names no policy to play it")
    return ref


def _seed_of(prepared: PreparedJob) -> int:
    """Return the policy's seed in the episode of a job."""
    job = prepared.job
    return episode_policy_seed(job.policy_seed, prepared.scene_episode.seed, job.arm)


def _close_policy(policy: Policy, record: Record, guard: CallGuard) -> None:
    """Record the policy's costs and close it; an error there does not change the outcome.

    Args:
        policy: that has played.
        record: gets the costs, and details of an error.
        guard: attributes errors to the policy.

    Raises:
        EpisodeLostError: the policy's process was lost before it reported the costs.
    """
    try:
        with guard.policy("policy's close()", "policy_close"):
            try:
                record.usage = policy_usage(policy)
                record.guessed = GUESSED in record.usage
            finally:
                close_policy(policy)
    except EpisodeError as error:
        record.details = record.details or error.details
