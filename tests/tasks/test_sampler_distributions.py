"""Random scenes are distributed as RoboMME's published ones.

For each task and difficulty, `SAMPLED` scenes of fixed seeds are compared with all published ones,
in every quantity of `measures` (Kolmogorov-Smirnov) and every label of `labels` (chi-square). All
tests of the eleven tasks are one family: by Bonferroni, equal distributions would be called
different somewhere in at most one of a hundred such families (`FAMILY_SIZE`).

What we draw otherwise on purpose is no label here: the direction of StopCube's path depends on its
target in RoboMME, the number of VideoUnmaskSwap's swaps on its layout. Both have RoboMME's
distribution by themselves.
"""

import functools
import itertools
import math
from collections import Counter
from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import chi2_contingency, ks_2samp

from roboirg.core.episode import DIFFICULTIES, SPLITS
from roboirg.core.errors import SceneRejectedError
from roboirg.core.motions import Away, Shuttle, Swap
from roboirg.episodes.published_episodes import published_episode
from roboirg.tasks import get_task
from roboirg.tasks.shared import fixtures, video_place
from roboirg.tasks.shared.fixtures import cube_footprint

TASKS = (
    "BinFill",
    "PickXtimes",
    "SwingXtimes",
    "StopCube",
    "VideoUnmask",
    "ButtonUnmask",
    "VideoUnmaskSwap",
    "ButtonUnmaskSwap",
    "VideoRepick",
    "VideoPlaceButton",
    "VideoPlaceOrder",
)
FAMILY_SIZE = 0.01
SAMPLED = 300
FIRST_SEED = 10_000_000
MOST_EPISODES = 100
KINDS = ("button", "bin", "cube", "hidden_cube", "container", "target", "site", "shuttle")
RARE = 10
"""Labels with fewer scenes in both samples together are joined."""


@functools.cache
def published(task, difficulty):
    """Scene and goal of all published episodes."""
    found = (
        published_episode(task, split, index) for split in SPLITS for index in range(MOST_EPISODES)
    )
    return [(one.scene, one.goal) for one in found if one and one.difficulty == difficulty]


def sampled(task, difficulty):
    """Scene and goal of the first seeds that give one."""
    found, seeds = [], itertools.count(FIRST_SEED)
    while len(found) < SAMPLED:
        try:
            found.append(get_task(task).sample(np.random.default_rng(next(seeds)), difficulty))
        except SceneRejectedError:
            continue
    return found


def distances(first, second):
    return [
        math.dist(one.position[:2], other.position[:2])
        for one in first
        for other in second
        if one is not other
    ]


def measures(scene, goal):
    """Quantities of a scene: places and spreads of each kind, gaps between kinds, times."""
    found = {}
    for kind in KINDS:
        items = scene.of_kind(kind)
        if not items:
            continue
        for axis in "xy":
            values = [getattr(item.position, axis) for item in items]
            found |= {f"first {kind} {axis}": values[0], f"last {kind} {axis}": values[-1]}
            found |= {
                f"mean {kind} {axis}": np.mean(values),
                f"spread {kind} {axis}": np.ptp(values),
            }
        found[f"{kind} yaw"] = items[0].yaw % (2.0 * math.pi)
        if len(items) > 1:
            nearest = [min(distances([item], items)) for item in items]
            found |= {f"nearest {kind}s": min(nearest), f"gap of {kind}s": np.mean(nearest)}
    for one, other in itertools.combinations(KINDS, 2):
        between = distances(scene.of_kind(one), scene.of_kind(other))
        if between:
            found |= {f"{one} to {other}": min(between), f"mean {one} to {other}": np.mean(between)}
    wanted = wanted_object(scene, goal)
    if wanted is not None:
        found |= {"wanted x": wanted.position.x, "wanted y": wanted.position.y}
    for motion in scene.motions:
        if isinstance(motion, Shuttle):
            along = [end - begin for begin, end in zip(motion.begin, motion.end, strict=True)]
            found |= {"length of path": math.hypot(*along), "direction": math.atan2(*along[:2])}
            found |= {f"rgb {number}": value for number, value in enumerate(scene["shuttle"].rgb)}
    return found


def wanted_object(scene, goal):
    """The object that the goal or the video singles out, if any."""
    slots = dict(goal.slots)
    if scene.past:
        return scene[scene.past[0].subject]
    color = slots.get("color") or (slots.get("colors") or [None])[0]
    named = [item for item in scene.objects if item.color == color]
    return named[0] if color else None


def labels(scene, goal):
    """Countable traits of a scene: numbers of objects, slots of the goal, motions, the past."""
    found = {f"number of {kind}s": len(scene.of_kind(kind)) for kind in KINDS}
    for slot, value in goal.slots:
        values = value if isinstance(value, tuple) else (value,)
        found |= {f"{slot} {place}": one for place, one in enumerate(values)}
        found[f"length of {slot}"] = len(values)
        if slot == "counts":
            found["goal's cubes"] = sum(values)
    cubes = (*scene.of_kind("cube"), *scene.of_kind("hidden_cube"))
    colors = [cube.color for cube in cubes]
    found |= {"first color": colors[:1], "last color": colors[-1:]}
    found["cubes per color"] = sorted(Counter(colors).values())
    found["over cubes"] = sorted(str(cube.inside) for cube in cubes)
    motions = scene.motions
    found["late"] = sum(isinstance(one, Away) and one.start == 0 for one in motions)
    swaps = [one for one in motions if isinstance(one, Swap)]
    found["number of swaps"] = len(swaps)
    found["undone"] = len({frozenset({one.first, one.second}) for one in swaps}) - len(swaps)
    hiding = {cube.inside for cube in cubes}
    answer = wanted_object(scene, goal)
    for place, swap in enumerate(swaps):
        moved = {swap.first, swap.second}
        found[f"swap {place} moves the wanted"] = bool(
            answer and {answer.name, answer.inside} & moved
        )
        found[f"swap {place} starts at a cube"] = swap.first in hiding
        found[f"swap {place} moves discs in use"] = len(moved & {one.place for one in scene.past})
    found["interval"] = [one.interval for one in motions if isinstance(one, Shuttle)]
    found["length of the past"] = len(scene.past)
    if scene.past:
        found["past"] = [fact.kind for fact in scene.past]
        found["discs of the past"] = [fact.place for fact in scene.past[:2]]
        found["number of the video's cube"] = list(scene.objects).index(answer)
    return found


def of_key(rows, key):
    return [row[key] for row in rows if key in row]


def p_values(task, difficulty, ours):
    """A p-value for every measure and label that differs within the two samples."""
    theirs = published(task, difficulty)
    found = {}
    two = [[measures(*one) for one in scenes] for scenes in (ours, theirs)]
    for key in sorted(set().union(*two[0], *two[1])):
        first, second = (of_key(rows, key) for rows in two)
        if not first or not second:
            found[key] = 0.0
        elif np.ptp([*first, *second]) > 1e-6:
            # Published places are rounded to 1e-7 m.
            found[key] = ks_2samp(np.round(first, 6), np.round(second, 6), method="asymp").pvalue
    two = [[labels(*one) for one in scenes] for scenes in (ours, theirs)]
    for key in sorted(set().union(*two[0], *two[1])):
        counts = [Counter(map(str, of_key(rows, key))) for rows in two]
        found[key] = same_shares(*counts)
    return found


def same_shares(first, second):
    """Chi-square's p-value; labels that are rare in both are joined."""
    both = first + second
    kept = [label for label in both if both[label] >= RARE]
    table = [[counts[label] for label in kept] for counts in (first, second)]
    for row, counts in zip(table, (first, second), strict=True):
        row.append(counts.total() - sum(row))
    filled = np.array(table)[:, np.sum(table, axis=0) > 0]
    return 1.0 if filled.shape[1] < 2 else chi2_contingency(filled).pvalue


@functools.cache
def family():
    """All p-values, by task, difficulty and name."""
    return {
        (task, difficulty, key): p
        for task in TASKS
        for difficulty in DIFFICULTIES
        for key, p in p_values(task, difficulty, sampled(task, difficulty)).items()
    }
