#!/usr/bin/env python3
"""Check RoboMME's published episodes in this simulator: videos, swaps, and the oracle.

python scripts/check_published_episodes.py [--split test] [--tasks all] [--workers 2]

Plays each episode's video, compares what the policy then finds with what RoboMME's simulator had
(``ready``, ``frames``, ``elapsed``, ``swap_schedule`` in ``tests/episodes/robomme``), and lets the
oracle play the rest, without pictures. Prints a table by task and a line for each exception; ends
with 1 if the oracle fails in an episode. The test split takes 3 minutes with two processes.
"""

from __future__ import annotations

import argparse
import functools
import math
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from convert_robomme_episodes import Row, body_name, read_rows
from rich.console import Console
from rich.table import Table

from roboirg.core.episode import Episode, Split
from roboirg.core.errors import MotionPlanningError
from roboirg.core.motions import Shuttle, Swap
from roboirg.core.observations import Demonstration
from roboirg.envs.environment import RoboIRGEnv
from roboirg.envs.factory import make
from roboirg.policies import play
from roboirg.policies.builtin.oracle_policy import OraclePolicy
from roboirg.runs.plan.option_parsing import parse_names, parse_splits
from roboirg.simulation.motion_player import shuttle_position
from roboirg.tasks import find_tasks
from roboirg.tasks.splits.published_episodes import published_episode
from roboirg.tasks.splits.splits import get_episode, split_episodes
from roboirg.util.parallel_map import parallel_map

ROWS = Path(__file__).parents[1] / "tests" / "episodes" / "robomme"
ROBOT = "panda_wristcam"
SITE = "goal_site"
"""Invisible, and under the table in RoboMME."""
JOINT_LIMIT = 1e-6
"""rad."""
BODY_LIMITS = (1e-4, 5e-3)
"""m."""
TABLE_REACH = 3.0
"""m; what is farther away is out of the world."""

Slot = tuple[str, Split, int]
"""Task, split and index of an episode."""


@dataclass
class Comparison:
    """How an episode compares with RoboMME's.

    Attributes:
        moves: whether the arm moves in the video.
        recorded: whether the video shows RoboMME's recorded actions.
        failure: why the oracle fails; None if it succeeds.
        joints: largest difference of a joint after the video, rad; infinite if there is no video.
        bodies: distance of each body from its place there, m.
        lengths: frames and control steps of the video, ours and theirs.
        swaps: for each swap whose partner RoboMME's data name, the two objects of ours and theirs.
    """

    moves: bool
    recorded: bool
    failure: str | None = None
    joints: float = math.inf
    bodies: Mapping[str, float] = field(default_factory=dict)
    lengths: tuple[tuple[int, int], tuple[int, int]] = ((0, 0), (0, 0))
    swaps: Sequence[tuple[tuple[str, str], tuple[str, str]]] = ()

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
        self._row, self._result = row, result

    def reset(self, instruction: str, demonstration: Demonstration) -> None:
        """Compare, then plan as the oracle."""
        env, row, result = self.env, self._row, self._result
        frames, steps = len(demonstration["joint_positions"]) + 1, env.session.world.elapsed
        result.lengths = (frames, steps), (row["frames"], row["elapsed"])
        result.joints = _joint_difference(env, row)
        result.bodies = dict(_distances(env, row, _our_names(env.episode, row)))
        super().reset(instruction, demonstration)


def compare(slot: Slot) -> Comparison:
    """Play an episode with the oracle and compare it with RoboMME's."""
    episode, row = get_episode(*slot), _rows()[slot]
    moves = any(stage.primitive.kind == "pick_cube" for stage in episode.demonstration)
    result = Comparison(moves, episode.recorded)
    result.swaps = tuple(_swaps(episode, row, _our_names(episode, row)))
    try:
        info = play(make(episode, cameras=()), ComparingOracle(row, result))
    except MotionPlanningError as error:
        result.failure = str(error)
    else:
        if info["status"] != "success":
            result.failure = str(info["cause"] or info["status"])
    return result


@functools.cache
def _rows() -> Mapping[Slot, Row]:
    return {(row["task"], row["dataset"], row["episode"]): row for row in read_rows(ROWS)}


def _our_names(episode: Episode, row: Row) -> dict[str, str]:
    """Return our name of each body of RoboMME's: the object that starts at its place."""
    return {
        name: min(
            episode.scene.objects, key=lambda item: math.dist(item.position, _place(body))
        ).name
        for name, body in row["start"].items()
        if name not in (ROBOT, SITE)
    }


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
        if max(math.hypot(*place[:2]), math.hypot(here.x, here.y)) < TABLE_REACH:
            yield ours, math.dist(place, here)
        elif min(math.hypot(*place[:2]), math.hypot(here.x, here.y)) < TABLE_REACH:
            yield ours, math.inf


def _swaps(
    episode: Episode, row: Row, names: Mapping[str, str]
) -> Iterator[tuple[tuple[str, str], tuple[str, str]]]:
    ours = [motion for motion in episode.scene.motions if isinstance(motion, Swap)]
    facts = row["facts"]
    theirs = [pair[:2] for pair in facts.get("swap_schedule", ())]
    if "swap_target_a" in facts:
        theirs = [[facts["swap_target_a"], facts["swap_target_b"]]]
    for swap, (first, second) in zip(ours, theirs, strict=True):
        if second is not None:
            yield (swap.first, swap.second), (names[body_name(first)], names[body_name(second)])


# --- what is printed --------------------------------------------------------------------------


def exceptions(one: Comparison) -> Iterator[str]:
    """Yield what is not as in RoboMME, or not as it should be."""
    if one.failure is not None:
        yield f"the oracle fails: {one.failure}"
    if one.moves and not one.recorded:
        yield "the video is planned, as no recording completes it"
    if one.bodies and one.joints > JOINT_LIMIT:
        yield f"joints differ by up to {one.joints:.1e} rad"
    far = {name: away for name, away in one.bodies.items() if away > BODY_LIMITS[0]}
    if far:
        yield "off by " + ", ".join(f"{1e3 * away:.2f} mm ({name})" for name, away in far.items())
    if one.lengths[0] != one.lengths[1]:
        yield "frames and control steps are {} and {}, there {} and {}".format(
            *(number for pair in one.lengths for number in pair)
        )
    for ours, theirs in one.swaps:
        if ours != theirs:
            yield f"{ours[0]} swaps with {ours[1]}, there {theirs[0]} with {theirs[1]}"


COLUMNS: Mapping[str, Callable[[Comparison], bool]] = {
    "solved": lambda one: one.failure is None,
    f"joints within {JOINT_LIMIT:g} rad": lambda one: one.joints <= JOINT_LIMIT,
    "bodies within 0.1 mm": lambda one: one.farthest <= BODY_LIMITS[0],
    "within 5 mm": lambda one: one.farthest <= BODY_LIMITS[1],
    "frames, steps equal": lambda one: one.lengths[0] == one.lengths[1],
}


def print_table(found: Mapping[Slot, Comparison], console: Console) -> None:
    """Print counts by task, for all, and for the episodes in whose videos the arm moves."""
    table = Table(box=None)
    for name in ("task", "episodes", *COLUMNS, "swap partners"):
        table.add_column(name, justify="left" if name == "task" else "right")
    for task in dict.fromkeys(slot[0] for slot in found):
        _add_row(table, task, [one for slot, one in found.items() if slot[0] == task])
    _add_row(table, "all", list(found.values()))
    _add_row(table, "video with moving arm", [one for one in found.values() if one.moves])
    console.print(table)


def _add_row(table: Table, name: str, group: Sequence[Comparison]) -> None:
    if group:
        counts = [str(sum(map(holds, group))) for holds in COLUMNS.values()]
        pairs = [pair for one in group for pair in one.swaps]
        equal = sum(ours == theirs for ours, theirs in pairs)
        table.add_row(name, str(len(group)), *counts, f"{equal} of {len(pairs)}" if pairs else "")


def main() -> int:
    """Compare the episodes; returns 1 if the oracle fails in one of them."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--split", default="test", help="train, val, test or all")
    parser.add_argument("--tasks", default="all", help="names or suites, separated by commas")
    parser.add_argument("--workers", type=int, default=2, help="processes")
    options = parser.parse_args()
    episodes = split_episodes(
        find_tasks(parse_names("task", options.tasks)), parse_splits(options.split)
    )
    slots: list[Slot] = [(one.task, one.split, one.index) for one in episodes]
    slots = [slot for slot in slots if published_episode(*slot)]
    found = dict(parallel_map(compare, slots, options.workers))
    found = {slot: found[slot] for slot in slots}
    console = Console(width=150)
    print_table(found, console)
    for (task, split, index), one in found.items():
        for text in exceptions(one):
            console.print(f"{task}/{split}/{index}: {text}.", highlight=False)
    return int(any(one.failure is not None for one in found.values()))


if __name__ == "__main__":
    sys.exit(main())
