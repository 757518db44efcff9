"""One job, played to its record.

| what goes wrong | outcome | cause |
| --- | --- | --- |
| the task's rules are broken, or time is up | failure | the judge's words |
| the policy raises, or wants to exit | error | ``policy: …`` |
| the policy's action cannot be executed | error | ``invalid action: …`` |
| the world or the demonstration raises | error | ``environment: …`` |
| no Vulkan device, a missing dependency | none: the run stops | |
| a film cannot be written | as without it | |
"""

from __future__ import annotations

import datetime as dt
import importlib.metadata
import json
import re
import time
import traceback
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple, cast

import numpy as np
from numpy.typing import NDArray

from roboirg import language, policies
from roboirg.actions import ActionSpace, check_chunk
from roboirg.episode import ENVIRONMENT_VERSION, Episode
from roboirg.errors import (
    InvalidActionError,
    MissingDependencyError,
    RenderDeviceError,
    RoboIRGError,
)
from roboirg.evaluation.plan import VideoMode, say
from roboirg.evaluation.record import EventRecord, Job, MentionSpan, Outcome, Record, Turn
from roboirg.evaluation.video import Film, VideoOptions
from roboirg.observations import DemonstrationFrames, Observation
from roboirg.policies.base import Policy, PrivilegedPolicy
from roboirg.policies.loading import (
    is_privileged,
    policy_version,
    wanted_actions,
    wanted_cameras,
    wanted_demonstration_frames,
    wanted_history,
)
from roboirg.splits import get_episode

if TYPE_CHECKING:
    from roboirg.environment import RoboIRGEnv

Play = Callable[[Job], Record]
"""Plays one job. Executors send it to other processes, so it must pickle."""

VIDEO_FOLDER = "videos"
NOTHING_DRAWN = "none"

_LONGEST_CAUSE = 400


@dataclass(frozen=True, slots=True)
class Player:
    """Plays jobs with the real environment and policies.

    Attributes:
        folder: of the run; films go to ``videos/`` in it.
        video: which episodes are filmed.
        options: how they are filmed.
    """

    folder: Path
    video: VideoMode = "off"
    options: VideoOptions = field(default_factory=VideoOptions)

    def __call__(self, job: Job) -> Record:
        """Play one job.

        Raises:
            RenderDeviceError: no Vulkan device can render.
            MissingDependencyError: something has to be installed first.
        """
        started_at, start = utc_now(), time.monotonic()
        film = None
        if self.video != "off":
            film = Film(self.folder / VIDEO_FOLDER / f"{job.slug}.mp4", self.options)
        course = play_episode(job, film)
        video = self._keep(film, course)
        lost = None if film is None or film.trouble is None else one_line(film.trouble)
        return describe(
            job,
            course,
            video=video,
            film_lost=lost,
            started_at=started_at,
            duration_s=round(time.monotonic() - start, 3),
        )

    def _keep(self, film: Film | None, course: Course) -> str | None:
        if film is None:
            return None
        wanted = self.video == "all" or course.outcome != "success"
        if wanted and film.finish():
            return film.path.relative_to(self.folder).as_posix()
        film.discard()
        return None


@dataclass
class Course:
    """How an episode went; filled while it goes, so that an error leaves what was before it.

    Attributes:
        outcome: success, failure or error.
        cause: why not success.
        steps: control steps of the policy.
        demonstration_steps: frames of the video shown before.
        turn: control steps of the world before the policy's turn.
        events: what happened.
        render_device: driver's name, None if the episode did not get that far.
        details: traceback of an error.
    """

    outcome: Outcome = "error"
    cause: str | None = "environment: the episode did not begin"
    steps: int = 0
    demonstration_steps: int = 0
    turn: int = 0
    events: list[EventRecord] = field(default_factory=list)
    render_device: str | None = None
    details: str | None = None

    def note(self, info: Mapping[str, Any]) -> None:
        """Keep the events that the environment reports."""
        for event in info.get("events", ()):
            place = event.get("place")
            self.events.append(
                EventRecord(
                    step=int(event["step"]) - self.turn,
                    kind=str(event["kind"]),
                    subject=str(event["subject"]),
                    place=None if place is None else str(place),
                    holds=bool(event.get("holds", True)),
                )
            )


class Needs(NamedTuple):
    """What a policy needs of its environment.

    Attributes:
        cameras: whose pictures.
        actions: the space in which it acts.
        demonstration_frames: which pictures of the video.
        observe_every: after how many control steps it wants to look.
    """

    cameras: tuple[str, ...]
    actions: ActionSpace
    demonstration_frames: DemonstrationFrames = "all"
    observe_every: int | None = None


class _Fault(Exception):  # noqa: N818 - never leaves this file
    """Something other than the policy's skill ended the episode."""

    def __init__(self, cause: str, details: str) -> None:
        super().__init__(cause)
        self.cause, self.details = cause, details


def play_episode(job: Job, film: Film | None = None) -> Course:
    """Play one job and say how it went; every fault of policy or world ends up in the cause.

    Raises:
        RenderDeviceError: no Vulkan device can render.
        MissingDependencyError: something has to be installed first.
    """
    course = Course()
    env = None
    try:
        with _blame("policy"):
            policy = load_policy(job)
            needs = Needs(
                wanted_cameras(policy),
                wanted_actions(policy),
                wanted_demonstration_frames(policy),
                wanted_history(policy),
            )
        with _blame("environment"):
            env = make_env(job, needs)
        _play(job, env, policy, needs.actions, film, course)
    except _Fault as fault:
        course.outcome, course.cause, course.details = "error", fault.cause, fault.details
    finally:
        if env is not None:
            env.close()
    return course


def make_env(job: Job, needs: Needs) -> RoboIRGEnv:
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
        frame=job.frame,
        cameras=needs.cameras,
        actions=needs.actions.name,
        demonstration_frames=needs.demonstration_frames,
        observe_every=needs.observe_every,
        max_steps=job.max_steps,
    )


def load_policy(job: Job) -> Policy:
    """A fresh policy, so that nothing of an earlier episode is left in it.

    Its seed is made of the run's and the episode's: the same in every setting, another in every
    episode.
    """
    seeds = np.random.SeedSequence((job.policy_seed, _episode(job).seed))
    return policies.make_policy(job.policy, seed=int(seeds.generate_state(1)[0]))


def _play(
    job: Job,
    env: RoboIRGEnv,
    policy: Policy,
    actions: ActionSpace,
    film: Film | None,
    course: Course,
) -> None:
    with _blame("environment"):
        if film is not None:
            env.set_frame_hook(film.shoot, every=film.options.every)
        observation, info = env.reset()
        device = str(env.render_device)
        course.render_device = None if device == NOTHING_DRAWN else device
        course.demonstration_steps = len(info["demonstration"]["joint_positions"])
        course.turn = int(info["elapsed_steps"])
        course.note(info)
        instruction = env.instruction.text
    with _blame("policy"):
        if isinstance(policy, PrivilegedPolicy):
            policy.attach(env)
        policy.reset(instruction, info["demonstration"])
    status, cause = "ongoing", None
    while status == "ongoing":
        rows = _next_actions(policy, observation, actions)
        with _blame("environment"):
            observation, *_, info = env.step_chunk(rows)
        course.steps = int(info["steps"])
        course.note(info)
        status, cause = info["status"], info.get("cause")
    _judge(job, status, cause, course)


def _judge(job: Job, status: str, cause: str | None, course: Course) -> None:
    if status == "success":
        course.outcome, course.cause = "success", None
    elif status == "timeout":
        course.outcome = "failure"
        course.cause = cause or f"not done after {job.max_steps} steps"
    elif status == "failure":
        course.outcome, course.cause = "failure", cause or "the judge gave no cause"
    else:
        course.cause = f"environment: the episode ended with status {status!r}"


def _next_actions(
    policy: Policy, observation: dict[str, Any], space: ActionSpace
) -> NDArray[np.float64]:
    """The policy's next rows, all of them valid."""
    with _blame("policy"):
        return check_chunk(policy.act(cast("Observation", observation)), space)


@contextmanager
def _blame(whom: str) -> Iterator[None]:
    """Turn what is raised inside into a fault of policy or environment."""
    try:
        yield
    except (RenderDeviceError, MissingDependencyError, _Fault):
        # The first two would end every other episode just the same: the run stops.
        raise
    except InvalidActionError as error:
        raise _Fault(f"invalid action: {error}", traceback.format_exc()) from error
    except (Exception, SystemExit) as error:  # the boundary: anything is possible in there
        raise _Fault(f"{whom}: {one_line(error)}", traceback.format_exc()) from error


def one_line(error: BaseException) -> str:
    """An exception as one line that is the same in every process."""
    words = str(error) if isinstance(error, RoboIRGError) else f"{type(error).__name__}: {error}"
    words = re.sub(r"0x[0-9a-fA-F]{6,}", "0x…", " ".join(words.split())).rstrip(": ")
    return words.encode("utf-8", "replace").decode()[:_LONGEST_CAUSE]


def describe(
    job: Job,
    course: Course,
    *,
    started_at: str,
    duration_s: float = 0.0,
    video: str | None = None,
    film_lost: str | None = None,
) -> Record:
    """The record of a job that went so. Needs no simulator."""
    episode = _episode(job)
    instruction, plain = say(job), language.instruct(episode, "explicit")
    return Record(
        **dict(job),
        seed=episode.seed,
        difficulty=episode.difficulty,
        outcome=course.outcome,
        cause=course.cause,
        steps=course.steps,
        demonstration_steps=course.demonstration_steps,
        instruction=tuple(Turn(stage=u.stage, text=u.text) for u in instruction.utterances),
        mentions=tuple(
            MentionSpan(
                utterance=mention.utterance,
                start=mention.start,
                end=mention.end,
                role=mention.role,
                expression=mention.expression,
                slot=mention.slot,
                value=mention.value,
            )
            for mention in instruction.mentions
        ),
        command=plain.text,
        goal=dict(episode.goal.as_mapping()),
        # Exactly what a reader of the file will find.
        metadata=json.loads(json.dumps(dict(instruction.metadata))),
        privileged=is_privileged(job.policy),
        policy_version=policy_version(job.policy),
        events=tuple(course.events),
        video=video,
        film_lost=film_lost,
        details=course.details,
        render_device=course.render_device,
        language_version=str(language.LANGUAGE_VERSION),
        environment_version=ENVIRONMENT_VERSION,
        package_version=importlib.metadata.version("roboirgbench"),
        started_at=started_at,
        duration_s=duration_s,
    )


def utc_now() -> str:
    """The time, ISO 8601, to the second."""
    return dt.datetime.now(dt.UTC).isoformat(timespec="seconds")


def _episode(job: Job) -> Episode:
    return get_episode(job.task, job.split, job.episode)
