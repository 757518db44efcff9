#!/usr/bin/env python3
"""Check RoboMME's published episodes in this simulator: videos, swaps, and the oracle.

python scripts/check_published_episodes.py [--split test] [--tasks all] [--workers 2]

Plays each episode's video, compares what the policy then finds with what RoboMME's simulator had
(``ready``, ``frames``, ``elapsed``, ``swap_schedule`` in ``tests/episodes/robomme``), and lets the
oracle play the rest, without pictures. Prints a table by task and a line for each exception; ends
with 1 if the oracle fails in an episode. The test split takes 3 minutes with two processes.
"""

from __future__ import annotations

import functools
import math
import sys
from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, NamedTuple

import numpy as np
import typer
from convert_robomme_episodes import Row, body_name, read_rows
from rich.console import Console
from rich.table import Table
from seed_selection import oracle_failure

from roboirg.core.episode import Episode, episode_key
from roboirg.core.motions import Shuttle, Swap
from roboirg.core.observations import Demonstration
from roboirg.envs.environment import RoboIRGEnv
from roboirg.policies.builtin.oracle_policy import OraclePolicy
from roboirg.runs.plan.option_parsing import parse_names, parse_splits
from roboirg.simulation.motion_player import shuttle_position
from roboirg.tasks import find_tasks
from roboirg.tasks.splits.published_episodes import published_episode
from roboirg.tasks.splits.splits import split_episodes
from roboirg.util.parallel_map import parallel_map

ROWS = Path(__file__).parents[1] / "tests" / "episodes" / "robomme"
ROBOT = "panda_wristcam"
SITE = "goal_site"
"""Invisible, and under the table in RoboMME."""
JOINT_LIMIT = 1e-6
"""rad."""
FINE_LIMIT = 1e-4
COARSE_LIMIT = 5e-3
"""Of the distance of a body, m."""
TABLE_REACH = 3.0
"""m; what is farther away is out of the world."""


class VideoLength(NamedTuple):
    """Frames and control steps of a video."""

    frames: int
    steps: int


NO_VIDEO = VideoLength(0, 0)


class SwapPair(NamedTuple):
    """The two objects that change places here, and those that do in RoboMME."""

    ours: tuple[str, str]
    theirs: tuple[str, str]


@dataclass
class Comparison:
    """How an episode compares with RoboMME's.

    Attributes:
        moves: whether the arm moves in the video.
        recorded: whether the video shows RoboMME's recorded actions.
        failure: why the oracle fails; None if it succeeds.
        joints: largest difference of a joint after the video, rad; infinite if there is no video.
        bodies: distance of each body from its place there, m.
        our_length: of the video.
        their_length: of RoboMME's.
        swaps: those whose partners RoboMME's data name.
    """

    moves: bool
    recorded: bool
    failure: str | None = None
    joints: float = math.inf
    bodies: Mapping[str, float] = field(default_factory=dict)
    our_length: VideoLength = NO_VIDEO
    their_length: VideoLength = NO_VIDEO
    swaps: Sequence[SwapPair] = ()

    @property
    def farthest(self) -> float:
        """Largest distance of a body from its place in RoboMME, m."""
        return max(self.bodies.values(), default=math.inf)


class ComparingOracle(OraclePolicy):
    """The oracle, which first compares what it finds with what RoboMME's simulator had.

    Args:
        row: RoboMME's data of the episode.
        result: where the comparison is written.
    """

    def __init__(self, row: Row, result: Comparison) -> None:
        super().__init__()
        self._row = row
        self._result = result

    def reset(self, instruction: str, demonstration: Demonstration) -> None:
        """Compare, then plan as the oracle."""
        row = self._row
        result = self._result
        frames = len(demonstration["joint_positions"]) + 1
        result.our_length = VideoLength(frames, self.env.session.world.elapsed)
        result.their_length = VideoLength(row["frames"], row["elapsed"])
        result.joints = _joint_difference(self.env, row)
        result.bodies = dict(_distances(self.env, row, _our_names(self.env.episode, row)))
        super().reset(instruction, demonstration)


def compare(episode: Episode) -> Comparison:
    """Play an episode with the oracle and compare it with RoboMME's."""
    row = _rows()[episode.key]
    moves = any(stage.primitive.kind == "pick_cube" for stage in episode.demonstration)
    result = Comparison(moves, episode.recorded)
    result.swaps = tuple(_swaps(episode, row, _our_names(episode, row)))
    result.failure = oracle_failure(episode, ComparingOracle(row, result))
    return result


@functools.cache
def _rows() -> Mapping[str, Row]:
    """Return RoboMME's data by the names of the episodes."""
    return {
        episode_key(row["task"], row["dataset"], row["episode"]): row for row in read_rows(ROWS)
    }


def _our_names(episode: Episode, row: Row) -> dict[str, str]:
    """Return our name of each body of RoboMME's: the object that starts at its place."""
    names = {}
    for name, body in row["start"].items():
        if name not in (ROBOT, SITE):
            place = _place(body)
            nearest = min(episode.scene.objects, key=lambda item: math.dist(item.position, place))
            names[name] = nearest.name
    return names


def _place(body: Mapping[str, Sequence[float]] | Sequence[float]) -> Sequence[float]:
    """Return the position (3) of a body in a row, m."""
    pose = body["pose"] if isinstance(body, Mapping) else body
    return pose[:3]


def _joint_difference(env: RoboIRGEnv, row: Row) -> float:
    joints = env.session.world.robot.articulation.get_qpos().ravel()
    return float(np.abs(joints - row["ready"][ROBOT]["qpos"]).max())


def _distances(env: RoboIRGEnv, row: Row, names: Mapping[str, str]) -> Iterator[tuple[str, float]]:
    for theirs, ours in names.items():
        place = _place(row["ready"][theirs])
        here = env.session.world.bodies[ours].position
        for motion in env.episode.scene.motions:
            if isinstance(motion, Shuttle) and motion.subject == ours:
                # RoboMME moves it at the end of a step, after the picture; here the next one does.
                here = shuttle_position(motion, env.session.world.elapsed)
        is_here = math.hypot(here.x, here.y) < TABLE_REACH
        is_there = math.hypot(*place[:2]) < TABLE_REACH
        if is_here and is_there:
            yield ours, math.dist(place, here)
        elif is_here or is_there:
            yield ours, math.inf


def _swaps(episode: Episode, row: Row, names: Mapping[str, str]) -> Iterator[SwapPair]:
    swaps = [motion for motion in episode.scene.motions if isinstance(motion, Swap)]
    facts = row["facts"]
    theirs = [pair[:2] for pair in facts.get("swap_schedule", ())]
    if "swap_target_a" in facts:
        theirs = [[facts["swap_target_a"], facts["swap_target_b"]]]
    for swap, (first, second) in zip(swaps, theirs, strict=True):
        if second is not None:
            pair = (names[body_name(first)], names[body_name(second)])
            yield SwapPair((swap.first, swap.second), pair)


# --- what is printed --------------------------------------------------------------------------


def exceptions(comparison: Comparison) -> Iterator[str]:
    """Yield what is not as in RoboMME, or not as it should be."""
    if comparison.failure is not None:
        yield f"the oracle fails: {comparison.failure}"
    if comparison.moves and not comparison.recorded:
        yield "the video is planned, as no recording completes it"
    if comparison.bodies and comparison.joints > JOINT_LIMIT:
        yield f"joints differ by up to {comparison.joints:.1e} rad"
    far = []
    for name, distance in comparison.bodies.items():
        if distance > FINE_LIMIT:
            far.append(f"{1e3 * distance:.2f} mm ({name})")
    if far:
        yield f"off by {', '.join(far)}"
    here = comparison.our_length
    there = comparison.their_length
    if here != there:
        yield (
            f"frames and control steps are {here.frames} and {here.steps}, "
            f"there {there.frames} and {there.steps}"
        )
    for ours, theirs in comparison.swaps:
        if ours != theirs:
            yield f"{' swaps with '.join(ours)}, there {' with '.join(theirs)}"


def print_table(found: Mapping[Episode, Comparison], console: Console) -> None:
    """Print counts by task, for all, and for the episodes in whose videos the arm moves."""
    groups: dict[str, list[Comparison]] = defaultdict(list)
    for episode, comparison in found.items():
        groups[episode.task].append(comparison)
    groups["all"] = list(found.values())
    moving = [comparison for comparison in found.values() if comparison.moves]
    if moving:
        groups["video with moving arm"] = moving
    table = Table("task", box=None)
    for name in _counts([]):
        table.add_column(name, justify="right")
    for name, group in groups.items():
        table.add_row(name, *map(str, _counts(group).values()))
    console.print(table)


def _counts(group: Sequence[Comparison]) -> dict[str, object]:
    """Return the cells of some episodes, by the heads of their columns."""
    swaps = 0
    equal = 0
    for comparison in group:
        swaps += len(comparison.swaps)
        equal += sum(ours == theirs for ours, theirs in comparison.swaps)
    partners = ""
    if swaps:
        partners = f"{equal} of {swaps}"
    return {
        "episodes": len(group),
        "solved": sum(comparison.failure is None for comparison in group),
        f"joints within {JOINT_LIMIT:g} rad": sum(
            comparison.joints <= JOINT_LIMIT for comparison in group
        ),
        "bodies within 0.1 mm": sum(comparison.farthest <= FINE_LIMIT for comparison in group),
        "within 5 mm": sum(comparison.farthest <= COARSE_LIMIT for comparison in group),
        "frames, steps equal": sum(
            comparison.our_length == comparison.their_length for comparison in group
        ),
        "swap partners": partners,
    }


def main(
    split: Annotated[str, typer.Option(help="train, val, test or all")] = "test",
    tasks: Annotated[str, typer.Option(help="names or suites, separated by commas")] = "all",
    workers: Annotated[int, typer.Option(help="processes")] = 2,
) -> None:
    """Compare the episodes; ends with 1 if the oracle fails in one of them."""
    names = find_tasks(parse_names("task", tasks))
    episodes = []
    for episode in split_episodes(names, parse_splits(split)):
        if published_episode(episode.task, episode.split, episode.index):
            episodes.append(episode)
    compared = dict(parallel_map(compare, episodes, workers))
    found = {episode: compared[episode] for episode in episodes}
    console = Console(width=150)
    print_table(found, console)
    for episode, comparison in found.items():
        for text in exceptions(comparison):
            console.print(f"{episode.key}: {text}.", highlight=False)
    if any(comparison.failure is not None for comparison in found.values()):
        sys.exit(1)


if __name__ == "__main__":
    typer.run(main)
