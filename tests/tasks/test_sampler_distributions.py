"""Random scenes are distributed as RoboMME's published ones.

For each task and difficulty, `SAMPLED` scenes of fixed seeds are compared with all published ones,
in every quantity of `measures` (Kolmogorov-Smirnov) and every trait of `labels` (chi-square). All
tests of all tasks are one family, of size 1 % by Bonferroni: each of the 33 pairs of task and
difficulty has an equal share of it, and each comparison an equal share of its pair's.

What we draw otherwise on purpose is not compared: in RoboMME, the direction of StopCube's path
follows from its target, and the layout of VideoUnmaskSwap from the number of swaps. Here they are
independent; each by itself is as in RoboMME.
"""

import functools
import itertools
import math
from collections import Counter, defaultdict

import numpy as np
import pytest
from drawn_scenes import drawn_scenes
from scipy.stats import chi2_contingency, ks_2samp

from roboirg.core.episode import DIFFICULTIES, SPLITS, Goal
from roboirg.core.motions import Away, Shuttle, Swap
from roboirg.tasks.shared import fixtures
from roboirg.tasks.shared.fixtures import footprint
from roboirg.tasks.splits.published_episodes import published_episode

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
RESOLUTION = 1e-6
"""Differences that mean nothing: published places are rounded to 1e-7 m."""


@functools.cache
def published_scenes(task, difficulty):
    """Scene and goal of all published episodes."""
    found = (
        published_episode(task, split, index) for split in SPLITS for index in range(MOST_EPISODES)
    )
    return [(made.scene, made.goal) for made in found if made and made.difficulty == difficulty]


@functools.cache
def our_scenes(task, difficulty):
    """Scene and goal of the first seeds that give one."""
    seeds = itertools.count(FIRST_SEED)
    return list(itertools.islice(drawn_scenes(task, difficulty, seeds), SAMPLED))


def distances(first, second):
    return [
        math.dist(thing.position[:2], other.position[:2])
        for thing in first
        for other in second
        if thing is not other
    ]


def quantities(scene, goal):
    """Quantities of a scene: places and spreads of each kind, gaps between kinds, times."""
    found = {}
    for kind in KINDS:
        items = scene.of_kind(kind)
        if items:
            found |= measures_of_kind(kind, items)
    for near, other in itertools.combinations(KINDS, 2):
        between = distances(scene.of_kind(near), scene.of_kind(other))
        if between:
            found[f"{near} to {other}"] = min(between)
            found[f"mean {near} to {other}"] = np.mean(between)
    wanted = wanted_object(scene, goal)
    if wanted is not None:
        found["wanted x"] = wanted.position.x
        found["wanted y"] = wanted.position.y
    for run in scene.motions_of(Shuttle):
        found["length of path"] = math.dist(run.begin, run.end)
        found["direction"] = math.atan2(run.end.x - run.begin.x, run.end.y - run.begin.y)
        for number, value in enumerate(scene["shuttle"].rgb):
            found[f"rgb {number}"] = value
    return found


def measures_of_kind(kind, items):
    """Quantities of the objects of a kind, of which there is at least one."""
    found = {f"{kind} yaw": items[0].yaw % (2.0 * math.pi)}
    for axis in "xy":
        values = [getattr(item.position, axis) for item in items]
        found[f"first {kind} {axis}"] = values[0]
        found[f"last {kind} {axis}"] = values[-1]
        found[f"mean {kind} {axis}"] = np.mean(values)
        found[f"spread {kind} {axis}"] = np.ptp(values)
    if len(items) > 1:
        nearest = [min(distances([item], items)) for item in items]
        found[f"nearest {kind}s"] = min(nearest)
        found[f"gap of {kind}s"] = np.mean(nearest)
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
    found |= labels_of_goal(goal)
    cubes = (*scene.of_kind("cube"), *scene.of_kind("hidden_cube"))
    colors = [cube.color for cube in cubes]
    found["first color"] = colors[:1]
    found["last color"] = colors[-1:]
    found["cubes per color"] = sorted(Counter(colors).values())
    found["over cubes"] = sorted(str(cube.inside) for cube in cubes)
    found["late"] = sum(motion.start == 0 for motion in scene.motions_of(Away))
    found |= labels_of_swaps(scene, wanted_object(scene, goal), cubes)
    found["interval"] = [run.interval for run in scene.motions_of(Shuttle)]
    found["length of the past"] = len(scene.past)
    if scene.past:
        found["past"] = [fact.kind for fact in scene.past]
        found["discs of the past"] = [fact.place for fact in scene.past[:2]]
        found["number of the video's cube"] = list(scene.objects).index(wanted_object(scene, goal))
    return found


def labels_of_goal(goal):
    """The slots of a goal, how many values each has, and how many cubes are counted in all."""
    found = {}
    for slot, value in goal.slots:
        values = value if isinstance(value, tuple) else (value,)
        for place, part in enumerate(values):
            found[f"{slot} {place}"] = part
        found[f"length of {slot}"] = len(values)
        if slot == "counts":
            found["goal's cubes"] = sum(values)
    return found


def labels_of_swaps(scene, wanted, cubes):
    """What each swap moves, and how many swaps undo another one."""
    swaps = scene.motions_of(Swap)
    pairs = [{swap.first, swap.second} for swap in swaps]
    wanted_names = {wanted.name, wanted.inside} if wanted else set()
    hiding = {cube.inside for cube in cubes}
    in_use = {moment.place for moment in scene.past}
    found = {"number of swaps": len(swaps), "undone": len(set(map(frozenset, pairs))) - len(swaps)}
    for place, (swap, moved) in enumerate(zip(swaps, pairs, strict=True)):
        found[f"swap {place} moves the wanted"] = bool(wanted_names & moved)
        found[f"swap {place} starts at a cube"] = swap.first in hiding
        found[f"swap {place} moves discs in use"] = len(moved & in_use)
    return found


def p_values(task, difficulty, ours):
    """A p-value for every measure and label that is not the same in all scenes."""
    theirs = published_scenes(task, difficulty)
    found = {}
    for traits, p_value in ((quantities, same_distribution), (labels, same_shares)):
        our_values = values_by_trait(traits, ours)
        their_values = values_by_trait(traits, theirs)
        for key in our_values.keys() | their_values.keys():
            p = p_value(our_values[key], their_values[key])
            if p is not None:
                found[key] = p
    return found


def values_by_trait(traits, scenes):
    """Return for each trait its values in the scenes that have it."""
    found = defaultdict(list)
    for scene, goal in scenes:
        for key, value in traits(scene, goal).items():
            found[key].append(value)
    return found


def same_distribution(first, second):
    """Kolmogorov and Smirnov's p-value; None if all values are equal."""
    if not first or not second:
        return 0.0
    if np.ptp([*first, *second]) < RESOLUTION:
        return None
    return ks_2samp(np.round(first, 6), np.round(second, 6), method="asymp").pvalue


def same_shares(first, second):
    """Chi-square's p-value; labels that are rare in both are joined; None if only one is left."""
    counts = [Counter(map(str, values)) for values in (first, second)]
    both = counts[0] + counts[1]
    kept = [label for label in both if both[label] >= RARE]
    table = []
    for counted in counts:
        row = [counted[label] for label in kept]
        table.append([*row, counted.total() - sum(row)])
    filled = np.array(table)[:, np.sum(table, axis=0) > 0]
    return None if filled.shape[1] == 1 else chi2_contingency(filled).pvalue


def significant_differences(task, difficulty, ours):
    """What differs significantly between these scenes and the published ones."""
    found = p_values(task, difficulty, ours)
    share = FAMILY_SIZE / (len(TASKS) * len(DIFFICULTIES) * len(found))
    return {key: p for key, p in found.items() if p < share}


@pytest.mark.slow
@pytest.mark.parametrize("difficulty", DIFFICULTIES)
@pytest.mark.parametrize("task", TASKS)
def test_random_scenes_are_distributed_as_published_ones(task, difficulty):
    """Each task and difficulty is compared in all quantities and traits of its scenes."""
    assert not significant_differences(task, difficulty, our_scenes(task, difficulty))


# A wrong sampler is found out


def test_a_wrong_distance_between_cubes_is_detected_by_the_comparison(monkeypatch):
    """A check of the check: with gaps around whole cubes, the nearest ones stand farther apart."""
    monkeypatch.setattr(fixtures, "cube_obstacle", footprint)
    drawn_anew = our_scenes.__wrapped__("BinFill", "hard")

    found = significant_differences("BinFill", "hard", drawn_anew)

    assert "nearest cubes" in found


def test_a_number_that_is_never_drawn_is_detected_by_the_comparison():
    """A check of the check: three repetitions are replaced by two."""
    fewer = []
    for scene, goal in our_scenes("PickXtimes", "easy"):
        fewer.append((scene, Goal.of(color=goal["color"], repeats=min(goal["repeats"], 2))))

    assert "repeats 0" in significant_differences("PickXtimes", "easy", fewer)
