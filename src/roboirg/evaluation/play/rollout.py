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

from roboirg import policies
from roboirg.evaluation.episode_errors import (
    EpisodeError,
    EpisodeLostError,
    format_cause,
    one_line,
)
from roboirg.evaluation.hosting.host_pool import HostSettings
from roboirg.evaluation.hosting.hosted_policy import HostedPlanner, HostedPolicy
from roboirg.evaluation.hosting.policy_descriptions import PolicyDescription, describe_here
from roboirg.evaluation.play.call_guard import CallGuard
from roboirg.evaluation.play.guarded_loop import GuardedLoop
from roboirg.evaluation.play.job_instruction import PreparedJob
from roboirg.evaluation.play.policy_environment import job_needs, make_env
from roboirg.evaluation.play.prompt_shares import audit_job, too_long_text
from roboirg.evaluation.play.rollout_result import RolloutResult, make_record, utc_now
from roboirg.evaluation.play.video_writer import VideoWriter
from roboirg.evaluation.policy_calls import policy_usage
from roboirg.evaluation.records.action_log import write_actions
from roboirg.evaluation.records.film import VIDEO_FOLDER, VideoMode
from roboirg.evaluation.records.record import Job, Record
from roboirg.policies.by_name.loading import is_privileged, needs_host, planner_alone
from roboirg.policies.by_name.systems import SCRIPTED, make_hands
from roboirg.policies.contract.base import Policy, close_policy
from roboirg.policies.contract.policy_needs import PolicyNeeds
from roboirg.policies.contract.random_state import episode_policy_seed
from roboirg.policies.planners.hierarchical_policy import HierarchicalPolicy, with_planner
from roboirg.policies.prompt_length.tokenizer_file import prompt_limit
from roboirg.policies.vlm.models.reply_store import ReplySettings, use_replies

PlayJob = Callable[[Job], Record]
"""Function that plays one job. Executors send it to other processes, so it must be picklable."""

MAX_LOSSES = 20
"""How often an episode is played again because other episodes broke the policy's process."""


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

    def with_hosts(self, hosts: socket) -> EpisodeRunner:
        """Return a copy that asks for hosts on a line, as `HostPool.connect` returns it."""
        return replace(self, hosts=hosts)

    def __call__(self, job: Job) -> Record:
        """Play one job.

        Raises:
            EndOfRunError: no Vulkan device can render, a package has to be installed first, ….
        """
        started_at, start = utc_now(), time.monotonic()
        with use_replies(self.replies, job.slug):
            writer, result = self._play(job)
        video = self._finish_video(writer, result)
        error = None if writer is None else writer.error
        log = result.action_log
        return make_record(
            job,
            result,
            video=video,
            video_error=None if error is None else one_line(error),
            started_at=started_at,
            duration_s=round(time.monotonic() - start, 3),
            plan=self.plan,
            action_log=None if log is None else write_actions(log, self.folder),
        )

    def _play(self, job: Job) -> tuple[VideoWriter | None, RolloutResult]:
        """Play a job, again from its beginning if the policy's process is lost meanwhile."""
        alone, attempt = False, 0
        while True:
            attempt += 1
            writer = None
            if self.video != "off":
                writer = VideoWriter(self.folder / VIDEO_FOLDER / f"{job.slug}.mp4")
            try:
                result = self.play_once(job, writer, alone=alone)
            except EpisodeLostError as error:
                if attempt < MAX_LOSSES:
                    alone = alone or error.alone
                    if writer is not None:
                        writer.discard()
                    continue
                result, message = RolloutResult(), f"{error}, {attempt} times in a row"
                result.record_error(error.kind, format_cause(error.kind, message))
            result.attempt = attempt
            return writer, result

    def play_once(
        self, job: Job, writer: VideoWriter | None = None, *, alone: bool = False
    ) -> RolloutResult:
        """Play one job once; errors of the policy or the environment end up in the result.

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
        prepared.open_wordings()
        result = RolloutResult(prepared=prepared)
        hosts = self.hosts if needs_host(job.policy_spec) else None
        guard = CallGuard(result, self.policy_timeout_s, is_hosted=hosts is not None)
        policy: Policy | None = None
        try:
            if hosts is None:
                result.policy = describe_here(job.policy_spec)
            with guard.policy("policy's constructor", "policy_load"):
                if hosts is None:
                    policy = load_policy(prepared)
                else:
                    seed = _policy_seed(prepared)
                    policy = load_hosted_policy(hosts, job.policy_spec, seed, alone=alone)
                    privileged = is_privileged(job.policy_spec)
                    result.policy = PolicyDescription(policy.version, privileged)
                needs = job_needs(policy, job)
                result.prompt_limit = prompt_limit(needs)
                if self.refuse_long and result.prompt_limit is not None:
                    audit = audit_job(job, result.prompt_limit, prepared.instruction)
                    if message := too_long_text(*audit):
                        raise EpisodeError("prompt", message, "")
            play_with(policy, job, needs, result, guard, writer)
        except EpisodeError as error:
            result.record_error(error.kind, error.cause, error.details)
        finally:
            if policy is not None:
                _close_policy(policy, result, guard)
        return result

    def _finish_video(self, writer: VideoWriter | None, result: RolloutResult) -> str | None:
        """Keep or discard the video; return its path relative to the folder, or None."""
        if writer is None:
            return None
        wanted = self.video == "all" or result.outcome != "success"
        if wanted and writer.finish():
            return writer.path.relative_to(self.folder).as_posix()
        writer.discard()
        return None


def play_with(
    policy: Policy,
    job: Job,
    needs: PolicyNeeds,
    result: RolloutResult,
    guard: CallGuard,
    writer: VideoWriter | None = None,
) -> None:
    """Play one job with a loaded policy, which is not closed.

    Args:
        policy: answers the observations.
        job: what to play.
        needs: what the environment offers.
        result: is filled in.
        guard: attributes errors and measures calls.
        writer: gets the frames of a video.

    Raises:
        EpisodeError: the environment raised, or the policy, or an action cannot be executed.
    """
    env, stands = None, False
    try:
        with guard.environment("env_reset"):
            result.prepared = result.prepared or PreparedJob(job)
            env = make_env(result.prepared, needs)
            result.needs = needs.declared
        GuardedLoop(env, policy, job, needs.action_space, result, guard, writer).play()
        stands = True
    except EpisodeError as error:
        stands = error.kind != "environment"
        raise
    finally:
        if env is not None:
            with contextlib.closing(env), guard.environment("env_step"):
                if result.action_space is not None and stands:
                    result.end_state = env.end_state()


def load_policy(prepared: PreparedJob) -> Policy:
    """Return a new policy object, so that no state of an earlier episode remains."""
    return policies.make_policy(prepared.job.policy_spec, seed=_policy_seed(prepared))


def load_hosted_policy(
    hosts: socket, spec: str, seed: int, *, alone: bool = False
) -> HostedPolicy | HierarchicalPolicy:
    """Return a policy in a process of its own; scripted hands of a user's planner are in this."""
    if (planner := planner_alone(spec)) is None:
        return HostedPolicy(hosts, spec, seed, alone=alone)
    hosted = HostedPlanner(hosts, planner, seed, alone=alone)
    return with_planner(hosted, make_hands(SCRIPTED, seed), spec.partition("?")[0])


def _policy_seed(prepared: PreparedJob) -> int:
    job = prepared.job
    return episode_policy_seed(job.policy_seed, prepared.scene_episode.seed, job.arm)


def _close_policy(policy: Policy, result: RolloutResult, guard: CallGuard) -> None:
    """Read the policy's costs and close it; errors there do not change the outcome.

    Raises:
        EpisodeLostError: the policy's process was lost before it reported the costs.
    """
    try:
        with guard.policy("policy's close()", "policy_close"):
            try:
                result.usage = policy_usage(policy)
            finally:
                close_policy(policy)
    except EpisodeError as error:
        result.details = result.details or error.details
    hosted = getattr(policy, "planner", policy)
    if isinstance(hosted, HostedPolicy):
        result.timings["policy_wait"] = round(hosted.waited_s, 6)
