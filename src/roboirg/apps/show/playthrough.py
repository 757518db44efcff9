"""Pictures of the oracle playing an episode."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

from roboirg.apps.show.episode_strip import SpokenSetting, StripMoment, draw_strip
from roboirg.core.episode import Episode
from roboirg.core.errors import MotionPlanningError
from roboirg.core.motions import Away, Motion, Swap
from roboirg.envs.factory import make
from roboirg.evaluation.analysis.figures.figure_style import save
from roboirg.judging import Status, plain_subgoal
from roboirg.policies import make_policy, play
from roboirg.util.media import evenly_spaced

if TYPE_CHECKING:
    from roboirg.envs.environment import RoboIRGEnv

MAX_MOMENTS, MIN_MOMENTS = 12, 6
"""Moments on a sheet; fillers are added up to the minimum."""
FILLER_STEPS = 16
"""Control steps between candidates for fillers."""

_ESSENTIAL, _STAGE, _KEY_EVENT, _VIDEO_STAGE, _FILLER = range(5)


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
        verdict = info["status"] + (f": {info['cause']}" if info["cause"] else "")
    done = f": {plain_subgoal(episode.stages[-1])}" if verdict == Status.SUCCESS else ""
    recorder.capture(env, _ESSENTIAL, f"{verdict}{done}")
    return Playthrough(verdict, env.session.world.elapsed, recorder.chosen())


def write_strip(
    episode: Episode, said: Sequence[SpokenSetting], path: Path
) -> tuple[str, tuple[Path, ...]]:
    """Write a strip of the oracle's play, for light and dark pages.

    Args:
        episode: to play.
        said: what to print above the pictures.
        path: of the picture; its twin for dark pages ends in ``-dark``.

    Returns:
        The result in words, and the files.

    Raises:
        InvalidValueError: the files cannot be written.
        RenderDeviceError: no Vulkan device can render.
        MissingDependencyError: the simulator or matplotlib is not installed.
    """
    played = play_through(episode)
    title = f"{episode.key} ({episode.difficulty}, seed {episode.seed})"
    paths = save(
        lambda: draw_strip(title, said, played.moments), path.parent, path.stem, formats=("png",)
    )
    return f"{played.verdict} after {played.steps} steps", paths


@dataclass
class _MomentRecorder:
    """Captures remarkable moments after each control step.

    Attributes:
        key_events: key events of the scene.
        captured: the newest moment of each step, with its rank.
    """

    key_events: KeyEvents
    captured: dict[int, tuple[int, StripMoment]] = field(default_factory=dict)
    _completed: int = 0
    _is_demonstration: bool | None = None

    def __call__(self, env: RoboIRGEnv, is_demonstration: bool) -> None:
        judge = env.session.judge
        step = env.session.world.elapsed
        key_event = self.key_events.at(step, judge.index)
        begins = is_demonstration != self._is_demonstration
        completes = judge.index > self._completed
        self._is_demonstration = is_demonstration
        if begins:
            what = "the video begins" if is_demonstration else "the policy's turn begins"
            self.capture(env, _ESSENTIAL, what)
        elif completes:
            what = plain_subgoal(judge.stages[judge.index - 1])
            self.capture(env, _VIDEO_STAGE if is_demonstration else _STAGE, f"done: {what}")
        elif key_event is not None:
            self.capture(env, _KEY_EVENT, key_event)
        elif step % FILLER_STEPS == 0:
            due = judge.current
            self.capture(env, _FILLER, plain_subgoal(due) if due else "")
        self._completed = judge.index

    def capture(self, env: RoboIRGEnv, rank: int, caption: str) -> None:
        """Capture the current pictures."""
        step = env.session.world.elapsed
        picture = env.picture("front").copy()
        moment = StripMoment(step, caption, picture, bool(self._is_demonstration))
        self.captured[step] = (rank, moment)

    def chosen(self) -> tuple[StripMoment, ...]:
        """Return the most remarkable moments, in order of time."""
        ranked = [self.captured[step] for step in sorted(self.captured)]
        chosen = choose_moments([rank for rank, _ in ranked])
        return tuple(ranked[position][1] for position in chosen)


def choose_moments(ranks: Sequence[int]) -> tuple[int, ...]:
    """Choose the moments of a sheet by rank; 0 is the most remarkable.

    Adds moments rank by rank while they fit, evenly spaced if not all do. The last rank only fills
    a sheet up to the minimum.
    """
    chosen: list[int] = []
    for rank in range(_FILLER + 1):
        candidates = [position for position, one in enumerate(ranks) if one == rank]
        room = max(0, (MIN_MOMENTS if rank == _FILLER else MAX_MOMENTS) - len(chosen))
        chosen += [candidates[number] for number in evenly_spaced(len(candidates), room)]
    return tuple(sorted(chosen))


class KeyEvents:
    """Reports, step by step, the objects that move by themselves.

    Args:
        motions: scripted motions of the scene.
    """

    def __init__(self, motions: Sequence[Motion]) -> None:
        self._swaps = [motion for motion in motions if isinstance(motion, Swap)]
        self._appearances: dict[int, list[str]] = {}
        for motion in motions:
            if isinstance(motion, Away) and motion.under is None:
                self._appearances.setdefault(motion.end + 1, []).append(motion.subject)
        self._stage_starts: dict[int, int] = {}

    def at(self, step: int, stage: int) -> str | None:
        """Return the event after a control step, or None; call for every step.

        Args:
            step: control steps since reset.
            stage: index of the current stage.
        """
        self._stage_starts.setdefault(stage, step)
        for swap in self._swaps:
            begin = 0 if swap.stage is None else self._stage_starts.get(swap.stage)
            # Halfway, they are farthest from the straight line.
            if begin is not None and step == begin + swap.start + swap.steps // 2 + 1:
                return f"{_plain(swap.first)} and {_plain(swap.second)} change places"
        names = self._appearances.get(step)
        if not names:
            return None
        return f"{', '.join(map(_plain, names))} {'appears' if len(names) == 1 else 'appear'}"


def _plain(name: str) -> str:
    return name.replace("_", " ")
