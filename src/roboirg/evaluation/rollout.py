"""One job, played to its record.

| what goes wrong | outcome | kind of error |
| --- | --- | --- |
| the task's rules are broken, or time is up | failure | |
| the policy raises, or wants to exit | error | policy |
| the policy's action cannot be executed | error | invalid_action |
| the policy's server does not answer in time, or at all | error | timeout, connection |
| the world or the demonstration raises | error | environment |
| no Vulkan device, a missing dependency | none: the run stops | |
| a film cannot be written, a policy cannot say what it cost | as without it | |
"""

from __future__ import annotations

import contextlib
import json
import math
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple, cast

import numpy as np
from numpy.typing import NDArray
from pydantic import JsonValue

from roboirg import policies
from roboirg.core.actions import ActionSpace, check_chunk
from roboirg.core.errors import InvalidActionError, InvalidValueError
from roboirg.core.observations import DemonstrationFrames, Observation
from roboirg.episodes.splits import get_episode
from roboirg.evaluation.episode_errors import EpisodeError, attribute_errors, one_line
from roboirg.evaluation.executors.watchdog import Phase, watched
from roboirg.evaluation.plan import VideoMode
from roboirg.evaluation.rollout_result import RolloutResult, make_record, utc_now
from roboirg.evaluation.video_writer import VideoOptions, VideoWriter
from roboirg.policies.base import Policy, PrivilegedPolicy
from roboirg.policies.requirements import (
    wanted_actions,
    wanted_cameras,
    wanted_demonstration_frames,
    wanted_history,
    wanted_history_cameras,
)
from roboirg.records.record import Job, Record

if TYPE_CHECKING:
    from roboirg.envs.environment import RoboIRGEnv

PlayJob = Callable[[Job], Record]
"""Plays one job. Executors send it to other processes, so it must pickle."""

VIDEO_FOLDER = "videos"
NO_RENDER_DEVICE = "none"

MAX_ROWS = 10_000
"""Actions that a policy may give at once; an episode has 1300 steps."""
MAX_METADATA_LENGTH = 65_536
"""Characters of JSON that a policy may say of itself."""


@dataclass(frozen=True, slots=True)
class EpisodeRunner:
    """Plays jobs with the real environment and policies.

    Attributes:
        folder: of the run; films go to ``videos/`` in it.
        video: which episodes are filmed.
        options: how they are filmed.
        policy_timeout_s: seconds that a call of the policy may take, where there is a supervisor.
        plan: fingerprint of the plan, for the records.
    """

    folder: Path
    video: VideoMode = "off"
    options: VideoOptions = field(default_factory=VideoOptions)
    policy_timeout_s: float | None = None
    plan: str | None = None

    def in_folder(self, folder: Path) -> EpisodeRunner:
        """The same, for another folder."""
        return replace(self, folder=folder)

    def __call__(self, job: Job) -> Record:
        """Play one job.

        Raises:
            RenderDeviceError: no Vulkan device can render.
            MissingDependencyError: something has to be installed first.
        """
        started_at, start = utc_now(), time.monotonic()
        film = None
        if self.video != "off":
            film = VideoWriter(self.folder / VIDEO_FOLDER / f"{job.slug}.mp4", self.options)
        course = play_episode(job, film, self.policy_timeout_s)
        video = self._keep(film, course)
        lost = None if film is None or film.trouble is None else one_line(film.trouble)
        return make_record(
            job,
            course,
            video=video,
            film_lost=lost,
            started_at=started_at,
            duration_s=round(time.monotonic() - start, 3),
            plan=self.plan,
        )

    def _keep(self, film: VideoWriter | None, course: RolloutResult) -> str | None:
        if film is None:
            return None
        wanted = self.video == "all" or course.outcome != "success"
        if wanted and film.finish():
            return film.path.relative_to(self.folder).as_posix()
        film.discard()
        return None


class EnvRequirements(NamedTuple):
    """What a policy needs of its environment.

    Attributes:
        cameras: whose pictures.
        actions: the space in which it acts.
        demonstration_frames: which pictures of the video.
        observe_every: after how many control steps it wants to look.
        history_cameras: whose pictures it wants of that; None for all of them.
        grounded: whether it passes on subgoals with pixels.
    """

    cameras: tuple[str, ...]
    actions: ActionSpace
    demonstration_frames: DemonstrationFrames = "all"
    observe_every: int | None = None
    history_cameras: tuple[str, ...] | None = None
    grounded: bool = False


class _CallGuard:
    """Calls of policy and world: blamed, watched and timed."""

    def __init__(self, course: RolloutResult, policy_timeout_s: float | None) -> None:
        self._timings = course.timings
        self._limit_s = policy_timeout_s

    @contextlib.contextmanager
    def policy(self, phase: Phase, name: str) -> Iterator[None]:
        with attribute_errors("policy"), watched(phase, self._limit_s), self._timed(name):
            yield

    @contextlib.contextmanager
    def world(self, name: str) -> Iterator[None]:
        with attribute_errors("environment"), watched("world"), self._timed(name):
            yield

    @contextlib.contextmanager
    def _timed(self, name: str) -> Iterator[None]:
        start = time.perf_counter()
        try:
            yield
        finally:
            spent = self._timings.get(name, 0.0) + time.perf_counter() - start
            self._timings[name] = round(spent, 6)


def play_episode(
    job: Job, film: VideoWriter | None = None, policy_timeout_s: float | None = None
) -> RolloutResult:
    """Play one job and say how it went; every fault of policy or world ends up in the cause.

    Raises:
        RenderDeviceError: no Vulkan device can render.
        MissingDependencyError: something has to be installed first.
    """
    course = RolloutResult()
    phases = _CallGuard(course, policy_timeout_s)
    policy, env = None, None
    try:
        with phases.policy("policy's constructor", "policy_load"):
            policy = load_policy(job)
            needs = env_requirements(policy, job)
        with phases.world("env_reset"):
            env = make_env(job, needs)
        _play_in(job, env, policy, needs.actions, film, course, phases)
    except EpisodeError as fault:
        course.fail(fault.kind, fault.cause, fault.details)
    finally:
        if policy is not None:
            _close_policy(policy, course, phases)
        if env is not None:
            env.close()
    return course


def env_requirements(policy: Policy, job: Job) -> EnvRequirements:
    """What a policy needs, where the job prescribes nothing else.

    Raises:
        InvalidValueError: it acts in another action space than is prescribed.
    """
    actions = wanted_actions(policy)
    if job.actions not in (None, actions.name):
        raise InvalidValueError(
            f"the policy acts in {actions.name!r}, but {job.actions!r} is prescribed."
        )
    frames, every = job.demonstration_frames, job.observe_every
    return EnvRequirements(
        wanted_cameras(policy),
        actions,
        wanted_demonstration_frames(policy) if frames is None else frames,
        wanted_history(policy) if every is None else every,
        wanted_history_cameras(policy),
        bool(getattr(policy, "grounded", False)),
    )


def make_env(job: Job, needs: EnvRequirements) -> RoboIRGEnv:
    """The environment of a job, for a policy that needs it so."""
    import roboirg

    return roboirg.make(
        job.task,
        setting=job.setting,
        form=job.form,
        split=job.split,
        episode=job.episode,
        stages=job.stages,
        distractor=job.distractor,
        distractors=job.distractors,
        frame=job.frame,
        cameras=needs.cameras,
        actions=needs.actions.name,
        grounded=needs.grounded,
        demonstration_frames=needs.demonstration_frames,
        observe_every=needs.observe_every,
        history_cameras=needs.history_cameras,
        meshes=job.meshes,
        max_steps=job.max_steps,
    )


def load_policy(job: Job) -> Policy:
    """A fresh policy, so that nothing of an earlier episode is left in it.

    Its seed is made of the run's and the episode's: the same in every setting, another in every
    episode.
    """
    episode = get_episode(job.task, job.split, job.episode)
    seeds = np.random.SeedSequence((job.policy_seed, episode.seed))
    return policies.make_policy(job.policy_spec, seed=int(seeds.generate_state(1)[0]))


def _play_in(
    job: Job,
    env: RoboIRGEnv,
    policy: Policy,
    actions: ActionSpace,
    film: VideoWriter | None,
    course: RolloutResult,
    phases: _CallGuard,
) -> None:
    with phases.world("env_reset"):
        if film is not None:
            film.caption = env.instruction.text
            env.set_frame_hook(film.shoot, every=film.options.every)
        observation, info = env.reset()
        if film is not None:
            film.shoot(env)  # what the policy sees first
        device = str(env.render_device)
        course.render_device = None if device == NO_RENDER_DEVICE else device
        course.demonstration_steps = len(info["demonstration"]["joint_positions"])
        course.turn = int(info["elapsed_steps"])
        course.note(info)
        instruction = env.instruction.text
    with phases.policy("policy's reset()", "policy_reset"):
        if isinstance(policy, PrivilegedPolicy):
            policy.attach(env)
        policy.reset(instruction, info["demonstration"])
        course.policy_metadata = _policy_metadata(policy)
    status, cause = "ongoing", None
    while status == "ongoing":
        with phases.policy("policy's act()", "policy_act"):
            rows = _next_actions(policy, observation, actions)
        with phases.world("env_step"):
            observation, *_, info = env.step_chunk(rows)
        course.steps = int(info["steps"])
        course.note(info)
        status, cause = info["status"], info.get("cause")
    if not course.settle(status, cause, job.max_steps):
        course.cause = f"environment: the episode ended with status {status!r}"


def _next_actions(
    policy: Policy, observation: dict[str, Any], space: ActionSpace
) -> NDArray[np.float64]:
    """The policy's next rows, all of them valid.

    Raises:
        InvalidActionError: they are not, or too many.
    """
    rows = policy.act(cast("Observation", observation))
    count = len(rows) if hasattr(rows, "__len__") else 0
    if count > MAX_ROWS:
        raise InvalidActionError(f"{count} actions at once are too many; at most {MAX_ROWS}.")
    return check_chunk(rows, space)


def _policy_metadata(policy: Policy) -> dict[str, JsonValue]:
    """What a policy says of itself, as a reader of the record will find it."""
    text = json.dumps(dict(getattr(policy, "metadata", {})), allow_nan=False)
    if len(text) > MAX_METADATA_LENGTH:
        raise InvalidValueError(
            f"the policy's metadata are {len(text)} characters of JSON; at most {MAX_METADATA_LENGTH}."
        )
    return cast("dict[str, JsonValue]", json.loads(text))


def _close_policy(policy: Policy, course: RolloutResult, phases: _CallGuard) -> None:
    """Ask what it cost and close it; trouble with that leaves the verdict as it is."""
    try:
        with phases.policy("policy's close()", "policy_close"):
            if hasattr(policy, "usage"):
                usage = {str(name): float(value) for name, value in policy.usage().items()}
                course.usage = {name: cost for name, cost in usage.items() if math.isfinite(cost)}
            if hasattr(policy, "close"):
                policy.close()
    except EpisodeError as fault:
        course.details = course.details or fault.details
