"""Pictures of the oracle playing an episode."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from enum import IntEnum
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from roboirg.analysis.figures.figure_style import save
from roboirg.apps.show.episode_strip import SpokenSetting, StripMoment, draw_strip
from roboirg.core.episode import Episode
from roboirg.core.errors import MotionPlanningError
from roboirg.core.motions import Away, Motion, Swap
from roboirg.envs.factory import make
from roboirg.judging import Status, plain_subgoal
from roboirg.policies import make_policy, play
from roboirg.util.media import evenly_spaced

if TYPE_CHECKING:
    from roboirg.envs.environment import RoboIRGEnv

MAX_MOMENTS = 12
MIN_MOMENTS = 6
"""Moments on a sheet; fillers are added up to the minimum."""
FILLER_STEPS = 16
"""Control steps between candidates for fillers."""


class Rank(IntEnum):
    """Why a moment is shown, the best reason first."""

    ESSENTIAL = 0  # the start of the video or of the policy's turn, or the end
    STAGE = 1  # the policy has completed a stage
    KEY_EVENT = 2  # objects move by themselves
    VIDEO_STAGE = 3  # a stage of the video is complete
    FILLER = 4  # nothing has happened


@dataclass(frozen=True)
class Playthrough:
    """The oracle's play of an episode.

    Attributes:
        verdict: success, failure, timeout, or error if planning failed; with the cause.
        steps: control steps since reset, including the demonstration.
        moments: the moments to show, in order of time.
    """

    verdict: str
    steps: int
    moments: tuple[StripMoment, ...]


def play_through(episode: Episode) -> Playthrough:
    """Let the oracle play; capture the start, completed stages, key events and the end.

    The last picture gets the verdict as its caption; after a success, with what was done last.

    Raises:
        RenderDeviceError: no Vulkan device can render.
        MissingDependencyError: the simulator is not installed.
    """
    env = make(episode, cameras=())
    recorder = _MomentRecorder(KeyEvents(episode.scene.motions))
    env.set_frame_hook(recorder)
    try:
        info = play(env, make_policy("oracle", 0))
    except MotionPlanningError as error:
        verdict = f"error: {error}"
    else:
        verdict = info["status"]
        if info["cause"]:
            verdict += f": {info['cause']}"
    caption = verdict
    if verdict == Status.SUCCESS:
        caption += f": {plain_subgoal(episode.stages[-1])}"
    recorder.capture(env, Rank.ESSENTIAL, caption)
    return Playthrough(verdict, env.session.world.elapsed, recorder.chosen())


def write_strip(
    episode: Episode, said: Sequence[SpokenSetting], moments: Sequence[StripMoment], path: Path
) -> tuple[Path, ...]:
    """Write a strip of an episode, for light and dark pages; return the files.

    Args:
        episode: what is shown.
        said: what to print above the pictures.
        moments: the pictures.
        path: of the strip; its twin for dark pages ends in ``-dark``.

    Raises:
        InvalidValueError: the files cannot be written.
        MissingDependencyError: matplotlib is not installed.
    """
    title = f"{episode.key} ({episode.difficulty}, seed {episode.seed})"
    draw = partial(draw_strip, title, said, moments)
    return save(draw, path.parent, path.stem, formats=("png",))


class _RankedMoment(NamedTuple):
    """A moment, and why it is shown."""

    rank: Rank
    moment: StripMoment


@dataclass
class _MomentRecorder:
    """Captures remarkable moments after each control step, as a frame hook of an environment.

    Attributes:
        key_events: key events of the scene.
        captured: the newest moment of each step, by the control steps since reset.
    """

    key_events: KeyEvents
    captured: dict[int, _RankedMoment] = field(default_factory=dict)
    _completed_stages: int = 0
    _is_demonstration: bool | None = None
    """Whether the last step belonged to the video; None before the first."""

    def __call__(self, env: RoboIRGEnv, is_demonstration: bool) -> None:
        """Capture the moment after a step for the first reason of these that it has, if any.

        In this order: a video or turn has begun, a stage is done, something moves by itself, the
        step's number is a multiple of `FILLER_STEPS`. Must be called after every step, as
        stages are noticed by comparison with the step before.
        """
        judge = env.session.judge
        step = env.session.world.elapsed
        key_event = self.key_events.at(step, judge.index)
        is_first = is_demonstration != self._is_demonstration
        is_stage_done = judge.index > self._completed_stages
        self._is_demonstration = is_demonstration
        self._completed_stages = judge.index
        if is_first:
            what = "the video begins" if is_demonstration else "the policy's turn begins"
            self.capture(env, Rank.ESSENTIAL, what)
        elif is_stage_done:
            rank = Rank.VIDEO_STAGE if is_demonstration else Rank.STAGE
            what = plain_subgoal(judge.stages[judge.index - 1])
            self.capture(env, rank, f"done: {what}")
        elif key_event is not None:
            self.capture(env, Rank.KEY_EVENT, key_event)
        elif step % FILLER_STEPS == 0:
            due = judge.current
            self.capture(env, Rank.FILLER, plain_subgoal(due) if due else "")

    def capture(self, env: RoboIRGEnv, rank: Rank, caption: str) -> None:
        """Capture the current picture of the front camera."""
        step = env.session.world.elapsed
        picture = env.picture("front").copy()
        moment = StripMoment(step, caption, picture, bool(self._is_demonstration))
        self.captured[step] = _RankedMoment(rank, moment)

    def chosen(self) -> tuple[StripMoment, ...]:
        """Return the most remarkable moments, in order of time."""
        in_order = [self.captured[step] for step in sorted(self.captured)]
        chosen = choose_moments([captured.rank for captured in in_order])
        return tuple(in_order[position].moment for position in chosen)


def choose_moments(ranks: Sequence[int]) -> tuple[int, ...]:
    """Return the positions of the moments to show, in order, given the rank of each (see `Rank`).

    Adds moments rank by rank, the lowest number first, while they fit, evenly spaced if not all do.
    The last rank only fills a sheet up to the minimum. Of the ranks 4, 4, 4, 0, 4, 1, those at the
    positions 3 and 5 are chosen first, and then the four fillers, because a sheet has six moments
    or more.
    """
    chosen: list[int] = []
    for rank in Rank:
        limit = MIN_MOMENTS if rank == Rank.FILLER else MAX_MOMENTS
        room = max(limit - len(chosen), 0)
        positions = np.flatnonzero(np.equal(ranks, rank))
        chosen += positions[evenly_spaced(len(positions), room)].tolist()
    return tuple(sorted(chosen))


class KeyEvents:
    """Reports, step by step, the objects that move by themselves.

    `at` notes when stages begin, so it must be called for every step, in order.

    Args:
        motions: scripted motions of the scene.
    """

    def __init__(self, motions: Sequence[Motion]) -> None:
        """Sort the motions into swaps, and objects that appear at a step, by that step."""
        self._swaps: list[Swap] = []
        self._appearing: dict[int, list[str]] = {}
        self._stage_starts: dict[int, int] = {}
        for motion in motions:
            if isinstance(motion, Swap):
                self._swaps.append(motion)
            if isinstance(motion, Away) and motion.under is None:
                self._appearing.setdefault(motion.end + 1, []).append(_plain(motion.subject))

    def at(self, step: int, stage: int) -> str | None:
        """Return what happens after a control step, or None; call for every step, in order.

        ``"cube 0 and cube 2 change places"``, when they are halfway.

        Args:
            step: control steps since reset.
            stage: index of the current stage.
        """
        self._stage_starts.setdefault(stage, step)
        for swap in self._swaps:
            # Its start counts from that of a stage, which may not have begun yet, or from 0.
            begin = 0 if swap.stage is None else self._stage_starts.get(swap.stage)
            # Halfway, they are farthest from the straight line.
            if begin is not None and step == begin + swap.start + swap.steps // 2 + 1:
                return f"{_plain(swap.first)} and {_plain(swap.second)} change places"
        names = self._appearing.get(step)
        if names is None:
            return None
        verb = "appears" if len(names) == 1 else "appear"
        return f"{', '.join(names)} {verb}"


def _plain(name: str) -> str:
    """Return the name of an object without underscores."""
    return name.replace("_", " ")
