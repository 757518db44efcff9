"""BinFill: put a number of cubes of each named color into the bin, then press the button.

Counting suite. Cubes vanish in the bin, so its content cannot be seen; in half of the episodes only
one cube of each color is there at first. The numbers are judged, not the order; the stages take the
colors in an order of the scene. Facts: RoboMME.
"""

from __future__ import annotations

import itertools
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from roboirg.core.conditions import Fact, FactCount, Rule
from roboirg.core.episode import (
    COLORS,
    Color,
    Difficulty,
    Goal,
    Primitive,
    Scene,
    SceneObject,
    Stage,
)
from roboirg.core.footprints import Obstacle, Region
from roboirg.core.motions import Away, Motion, Vanish
from roboirg.core.plain_text import counted
from roboirg.tasks.shared.fixtures import (
    BUTTON_REGION,
    ORDINALS,
    Bounds,
    ItemPlan,
    bin_keep_out,
    button_keep_out,
    draw_bin,
    draw_button,
    draw_cubes,
    draw_number,
    footprint,
)
from roboirg.tasks.shared.stages import PRESSED, press_stage
from roboirg.tasks.task import SceneAndGoal, Task
from roboirg.util.random_draws import draw, shuffled

COLORS_PRESENT: dict[Difficulty, int] = {"easy": 1, "medium": 2, "hard": 3}
CUBES: dict[Difficulty, Bounds] = {"easy": (4, 6), "medium": (8, 10), "hard": (10, 12)}
"""Fewest and most cubes on the table."""
GOAL_COLORS: dict[Difficulty, Bounds] = {
    "easy": (1, 1),
    "medium": (1, 2),
    "hard": (2, 3),
}
"""Number of colors among which the goal's cubes are drawn; one may get none."""
GOAL_CUBES: dict[Difficulty, Bounds] = {"easy": (1, 3), "medium": (2, 4), "hard": (3, 5)}
"""Fewest and most cubes that the goal puts into the bin."""
MAX_GOAL_CUBES = 5
GOAL_ORDER: tuple[Color, ...] = ("red", "blue", "green")

BIN_REGION = Region(0.05, 0.0, 0.1, 0.2)
CUBE_REGION = Region(-0.1, 0.0, 0.2, 0.25)
CUBE_GAP = 0.02
APPEAR_STEPS = 50
"""Control steps between the late cubes of a color."""


def sample(rng: np.random.Generator, difficulty: Difficulty) -> SceneAndGoal:
    """Draw button, bin and cubes of one to three colors, and a count for one or more of them.

    The order of the draws decides which scene a seed gives, here and in every function that takes
    `rng`: reordering them changes all episodes. Raises SceneRejectedError if something finds no
    room.
    """
    is_late = draw(rng, (False, True))  # whether only one cube of each color is there at first
    button = draw_button(rng, BUTTON_REGION)
    # RoboMME places the bin without looking at the button; here its walls stay off the base.
    bin_ = draw_bin(rng, BIN_REGION, [footprint(button)])
    wanted = _draw_wanted(rng, difficulty)
    cubes = _draw_cubes(rng, difficulty, wanted, [button_keep_out(button), bin_keep_out(bin_)])
    scene = Scene(
        objects=(button, bin_, *cubes),
        motions=plan_motions(cubes, late=is_late),
        color_order=tuple(shuffled(rng, _named(wanted))),
    )
    return scene, _goal(wanted)


def _draw_wanted(rng: np.random.Generator, difficulty: Difficulty) -> dict[Color, int]:
    """Draw the colors that are present, and for each the goal's number of cubes, perhaps 0.

    ``{"blue": 2, "red": 1, "green": 0}``: three colors are present; the goal's three cubes fell on
    the first two. Keys are in random order, which later draws use.
    """
    present = shuffled(rng, COLORS)[: COLORS_PRESENT[difficulty]]
    color_count = draw_number(rng, GOAL_COLORS[difficulty])
    cube_count = draw_number(rng, GOAL_CUBES[difficulty])
    wanted = dict.fromkeys(present, 0)
    for index in rng.integers(color_count, size=cube_count):
        color = present[index]
        wanted[color] += 1
    return wanted


def _draw_cube_colors(
    rng: np.random.Generator, difficulty: Difficulty, wanted: Mapping[Color, int]
) -> list[Color]:
    """Draw a color for each cube on the table, in the order in which they are placed.

    First as many as the goal wants, and at least one of each present color; then the others, of any
    present color; then all are shuffled. ``{"blue": 2, "red": 0}``, four cubes in all -> ``["red",
    "blue", "red", "blue"]``, for example.
    """
    present = list(wanted)
    colors: list[Color] = []
    for color, count in wanted.items():
        colors += [color] * max(count, 1)
    cube_count = draw_number(rng, CUBES[difficulty])
    others = rng.integers(len(present), size=cube_count - len(colors))
    colors += [present[index] for index in others]
    return shuffled(rng, colors)


def _draw_cubes(
    rng: np.random.Generator,
    difficulty: Difficulty,
    wanted: Mapping[Color, int],
    obstacles: Sequence[Obstacle],
) -> list[SceneObject]:
    """Draw the cubes on the table, numbered within their color, away from all obstacles.

    Red, blue, red -> ``cube_red_0``, ``cube_blue_0``, ``cube_red_1``.
    """
    plans = []
    numbers: Counter[Color] = Counter()
    for color in _draw_cube_colors(rng, difficulty, wanted):
        plans.append(ItemPlan(f"cube_{color}_{numbers[color]}", color, CUBE_REGION, CUBE_GAP))
        numbers[color] += 1
    return draw_cubes(rng, plans, obstacles)


def _named(wanted: Mapping[Color, int]) -> list[Color]:
    """Return the colors of which cubes are wanted, in the order in which goals list colors.

    ``{"blue": 2, "green": 0, "red": 1}`` -> ``["red", "blue"]``.
    """
    return [color for color in GOAL_ORDER if wanted.get(color)]


def _goal(wanted: Mapping[Color, int]) -> Goal:
    """Return the goal of some numbers of cubes by color; colors without any are not named.

    ``{"blue": 2, "green": 0, "red": 1}`` -> ``Goal.of(colors=("red", "blue"), counts=(1, 2))``.
    """
    named = _named(wanted)
    return Goal.of(colors=tuple(named), counts=tuple(wanted[color] for color in named))


def plan_motions(cubes: Sequence[SceneObject], *, late: bool) -> tuple[Motion, ...]:
    """Return the motions: binned cubes vanish, and late ones appear after the first of their color.

    If `late`, the second red cube appears after 50 steps, the third after 100. As in RoboMME, the
    place of a late cube may be occupied.
    """
    appearing: list[Motion] = []
    vanishing: list[Motion] = []
    for color in COLORS:
        names = [cube.name for cube in cubes if cube.color == color]
        if late:
            appearing += _appearing(names)
        vanishing += [Vanish(name, Fact("binned", name, "bin")) for name in names]
    return (*appearing, *vanishing)


def _appearing(names: Sequence[str]) -> Iterator[Away]:
    """Yield the motions by which the cubes of a color but the first appear one after the other."""
    for number, name in enumerate(names):
        if number > 0:
            yield Away(name, 0, APPEAR_STEPS * number)


def goals(scene: Scene) -> tuple[Goal, ...]:
    """Return all goals of one to five cubes in all, at most the present ones of each color.

    Two red cubes and a blue one -> one or two red; one blue; one or two red and one blue.
    """
    possible_counts = [range(len(_of_color(scene, color)) + 1) for color in GOAL_ORDER]
    goals = []
    for counts in itertools.product(*possible_counts):
        if 1 <= sum(counts) <= MAX_GOAL_CUBES:
            wanted = dict(zip(GOAL_ORDER, counts, strict=True))
            goals.append(_goal(wanted))
    return tuple(goals)


def stages(scene: Scene, goal: Goal) -> tuple[Stage, ...]:
    """Return 2 N + 1 stages: pick and put in once for each of N cubes, then press the button.

    What a stage forbids fails the episode when it becomes true. Any cube completes a stage, so the
    cubes may come in any order; the colors are judged by what the last stage forbids, a press with
    wrong numbers in the bin. In a subgoal, ``{at}`` stands for the point of the object `points_at`
    in the picture.
    """
    before_press = [stage.forbidding(PRESSED) for stage in _filling(scene, goal)]
    return (*before_press, press_stage().forbidding(*_wrong_counts(scene, goal)))


def _filling(scene: Scene, goal: Goal) -> Iterator[Stage]:
    """Yield the stages before the press: pick and put in, for each wanted cube in turn.

    The oracle takes that cube; any other one completes the stages as well. They forbid nothing yet.
    """
    cubes = [cube.name for cube in scene.of_kind("cube")]
    any_picked = FactCount(tuple(Fact("picked", cube) for cube in cubes))
    all_binned = _binned(cubes)
    for number, cube in enumerate(_wanted_cubes(scene, goal), start=1):
        yield Stage(
            expects=any_picked,
            primitive=Primitive("pick_cube", cube.name),
            subgoal=f"pick up the {cube.ordinal} {cube.color} cube {{at}}",
            points_at=cube.name,
        )
        yield Stage(
            expects=FactCount(all_binned, least=number),
            primitive=Primitive("drop_into", cube.name, "bin"),
            subgoal="put it into the bin {at}",
            points_at="bin",
        )


class _WantedCube(NamedTuple):
    """A cube that the oracle takes, and which one of its color it is.

    The second red cube: ``_WantedCube("cube_red_1", "red", "second")``.
    """

    name: str
    color: str
    ordinal: str


def _wanted_cubes(scene: Scene, goal: Goal) -> Iterator[_WantedCube]:
    """Yield the cubes that the oracle, which plays the goal perfectly, takes: color by color.

    Colors come in the scene's `color_order`, cubes of a color as numbered. Two red and one blue
    wanted, order blue, red -> the first blue cube, the first red one, the second red one.
    """
    counts = dict(goal.amounts)
    for color in dict.fromkeys((*scene.color_order, *counts)):
        names = _of_color(scene, color)[: counts.get(color, 0)]
        for name, ordinal in zip(names, ORDINALS, strict=False):
            yield _WantedCube(name, color, ordinal)


def _wrong_counts(scene: Scene, goal: Goal) -> Iterator[Rule]:
    """Yield rules against more cubes in the bin than the goal's, and fewer, for each color.

    Two red cubes wanted -> *put more than 2 red cubes into the bin*, *put fewer than …*; no blue
    one wanted -> *put a blue cube into the bin*. Colors that the scene lacks have no rules.
    """
    wanted = dict(goal.amounts)
    for color in GOAL_ORDER:
        binned = _binned(_of_color(scene, color))
        if not binned:
            continue
        count = wanted.get(color, 0)
        if count == 0:
            yield Rule(FactCount(binned), f"put a {color} cube into the bin", "wrong_object")
            continue

        cubes = f"{counted(count, f'{color} cube')} into the bin"
        too_few = f"put fewer than {cubes}"
        if count == 1:
            too_few = f"put no {color} cube into the bin"
        more = FactCount(binned, least=count + 1)
        fewer = FactCount(binned, least=0, most=count - 1)
        yield Rule(more, f"put more than {cubes}", "wrong_count")
        yield Rule(fewer, too_few, "wrong_count")


def _of_color(scene: Scene, color: str) -> list[str]:
    """Return the names of all cubes of a color, as numbered: ``["cube_red_0", "cube_red_1"]``."""
    return [cube.name for cube in scene.of_kind("cube") if cube.color == color]


def _binned(cubes: Iterable[str]) -> tuple[Fact, ...]:
    """Return the facts that cubes are in the bin, one for each."""
    return tuple(Fact("binned", cube, "bin") for cube in cubes)


TASK = Task(
    name="BinFill",
    suite="counting",
    code=4,
    spatial=True,
    sample=sample,
    goals=goals,
    stages=stages,
    words="BinFill.toml",
)
