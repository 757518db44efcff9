"""How the oracle plays an episode, in a few pictures."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

from roboirg.core.episode import Episode
from roboirg.core.errors import MotionPlanningError
from roboirg.core.observations import CAMERAS
from roboirg.envs.factory import make
from roboirg.judging import Status, plain_subgoal
from roboirg.language import instruct
from roboirg.policies import make_policy, play
from roboirg.visualization.contact_sheet import SheetPanel, compose_sheet, evenly_spaced, write_png
from roboirg.visualization.key_events import KeyEvents

if TYPE_CHECKING:
    from roboirg.envs.environment import RoboIRGEnv

MAX_MOMENTS, MIN_MOMENTS = 12, 6
"""Moments on a sheet; where less than the fewest are remarkable, others fill it up."""
FILLER_STEPS = 16
"""Control steps between two moments that may fill a sheet up."""

_ESSENTIAL, _STAGE, _HAPPENING, _SHOWN_STAGE, _FILLER = range(5)


@dataclass(frozen=True)
class Playthrough:
    """What came of it.

    Attributes:
        verdict: success, failure, timeout, or error where the oracle found no way; and the cause.
        steps: control steps since reset, the demonstration's included.
        moments: what is worth seeing, in order of time.
    """

    verdict: str
    steps: int
    moments: tuple[SheetPanel, ...]


def play_through(episode: Episode) -> Playthrough:
    """Let the oracle play, and keep pictures: start, completed stages, what moves by itself, end.

    Raises:
        RenderDeviceError: no Vulkan device can render.
        MissingDependencyError: the simulator is not installed.
    """
    env = make(episode, cameras=())
    watch = _MomentRecorder(KeyEvents(episode.scene.motions))
    env.set_frame_hook(watch)
    try:
        info = play(env, make_policy("oracle", 0))
    except MotionPlanningError as error:
        verdict = f"error: {error}"
    else:
        verdict = info["status"] + (f": {info['cause']}" if info["cause"] else "")
    done = f": {plain_subgoal(episode.stages[-1])}" if verdict == Status.SUCCESS else ""
    watch.shoot(env, _ESSENTIAL, f"{verdict}{done}")
    return Playthrough(verdict, env.session.world.elapsed, watch.chosen())


def draw_sheet(episode: Episode, path: Path) -> str:
    """Write a contact sheet of how the oracle plays an episode; what came of it, in words.

    Raises:
        InvalidValueError: the file cannot be written.
        RenderDeviceError: no Vulkan device can render.
        MissingDependencyError: the simulator is not installed.
    """
    played = play_through(episode)
    title = f"{episode.key} ({episode.difficulty}, seed {episode.seed})"
    sheet = compose_sheet(title, instruct(episode).text, played.moments)
    write_png(sheet, path)
    return f"{played.verdict} after {played.steps} steps"


@dataclass
class _MomentRecorder:
    """Looks at the world after each control step and photographs what is remarkable.

    Attributes:
        happenings: tells what moves by itself.
        seen: moments with their rank; one moment for each step, the newest.
    """

    happenings: KeyEvents
    seen: dict[int, tuple[int, SheetPanel]] = field(default_factory=dict)
    _completed: int = 0
    _is_demonstration: bool | None = None

    def __call__(self, env: RoboIRGEnv, is_demonstration: bool) -> None:
        judge, step = env.session.judge, env.session.world.elapsed
        happening = self.happenings.at(step, judge.index)
        begins = is_demonstration != self._is_demonstration
        completes = judge.index > self._completed
        self._is_demonstration = is_demonstration
        if begins:
            what = "the video begins" if is_demonstration else "the policy's turn begins"
            self.shoot(env, _ESSENTIAL, what)
        elif completes:
            what = plain_subgoal(judge.stages[judge.index - 1])
            self.shoot(env, _SHOWN_STAGE if is_demonstration else _STAGE, f"done: {what}")
        elif happening is not None:
            self.shoot(env, _HAPPENING, happening)
        elif step % FILLER_STEPS == 0:
            due = judge.current
            self.shoot(env, _FILLER, plain_subgoal(due) if due else "")
        self._completed = judge.index

    def shoot(self, env: RoboIRGEnv, rank: int, caption: str) -> None:
        """Keep how the world looks now."""
        step = env.session.world.elapsed
        pictures = tuple(env.picture(camera).copy() for camera in CAMERAS)
        moment = SheetPanel(step, caption, pictures, bool(self._is_demonstration))
        self.seen[step] = (rank, moment)

    def chosen(self) -> tuple[SheetPanel, ...]:
        """The most remarkable moments, in order of time."""
        ranked = [self.seen[step] for step in sorted(self.seen)]
        kept = choose_moments([rank for rank, _ in ranked])
        return tuple(ranked[position][1] for position in kept)


def choose_moments(ranks: Sequence[int]) -> tuple[int, ...]:
    """Which moments go on a sheet, given how remarkable each is, 0 the most.

    Rank by rank, as many as fit, evenly spaced where not all do; the last rank only fills a sheet
    up on which little else is.
    """
    kept: list[int] = []
    for rank in (_ESSENTIAL, _STAGE, _HAPPENING, _SHOWN_STAGE, _FILLER):
        candidates = [position for position, one in enumerate(ranks) if one == rank]
        room = max(0, (MIN_MOMENTS if rank == _FILLER else MAX_MOMENTS) - len(kept))
        kept += [candidates[number] for number in evenly_spaced(len(candidates), room)]
    return tuple(sorted(kept))
