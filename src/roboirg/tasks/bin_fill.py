"""BinFill: put a number of cubes of each named color into the bin, then press the button.

Counting suite. Cubes vanish in the bin, so its content cannot be seen; in half of the episodes only
one cube of each color is there at first. The numbers are judged, not the order; the stages take the
colors in an order of the scene. Facts: RoboMME.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Iterator, Sequence

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
    ORDINALS,
    Bounds,
    bin_keep_out,
    button_keep_out,
    draw_bin,
    draw_button,
    draw_cubes,
    draw_number,
    footprint,
)
from roboirg.tasks.shared.stages import PRESSED, press_stage
from roboirg.tasks.task import Commands, SceneAndGoal, Task, command_pools
from roboirg.util.random_draws import shuffled

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

BUTTON_REGION = Region(-0.2, 0.0, 0.05, 0.2)
BIN_REGION = Region(0.05, 0.0, 0.1, 0.2)
CUBE_REGION = Region(-0.1, 0.0, 0.2, 0.25)
CUBE_GAP = 0.02
APPEAR_STEPS = 50
"""Control steps between the late cubes of a color."""


def sample(rng: np.random.Generator, difficulty: Difficulty) -> SceneAndGoal:
    """Draw button, bin and cubes of one to three colors, and a count for one or more of them."""
    late = bool(rng.integers(2))
    button = draw_button(rng, BUTTON_REGION)
    # RoboMME places the bin without looking at the button; here its walls stay off the base.
    bin_ = draw_bin(rng, BIN_REGION, [footprint(button)])
    present = shuffled(rng, COLORS)[: COLORS_PRESENT[difficulty]]
    wanted = _draw_wanted(rng, difficulty, present)
    spawned = _draw_spawned(rng, difficulty, present, wanted)
    obstacles: list[Obstacle] = [button_keep_out(button), bin_keep_out(bin_)]
    cubes = draw_cubes(rng, _numbered(spawned), CUBE_GAP, obstacles)
    named = tuple(color for color in GOAL_ORDER if wanted.get(color))
    goal = Goal.of(colors=named, counts=tuple(wanted[color] for color in named))
    order = tuple(shuffled(rng, named))
    return Scene((button, bin_, *cubes), plan_motions(cubes, late=late), color_order=order), goal


def _draw_wanted(
    rng: np.random.Generator, difficulty: Difficulty, present: list[Color]
) -> dict[Color, int]:
    """Draw the goal's number of cubes for each color that is present."""
    candidates = draw_number(rng, GOAL_COLORS[difficulty])
    total = draw_number(rng, GOAL_CUBES[difficulty])
    wanted = dict.fromkeys(present, 0)
    for index in rng.integers(candidates, size=total):
        wanted[present[index]] += 1
    return wanted


def _draw_spawned(
    rng: np.random.Generator,
    difficulty: Difficulty,
    present: list[Color],
    wanted: dict[Color, int],
) -> list[Color]:
    """Draw a color for each cube: enough for the goal, and at least one of each present."""
    spawned = [color for color in present for _ in range(max(wanted[color], 1))]
    left = draw_number(rng, CUBES[difficulty]) - len(spawned)
    spawned += [present[index] for index in rng.integers(len(present), size=left)]
    return shuffled(rng, spawned)


def _numbered(spawned: list[Color]) -> Iterator[tuple[str, Color, Region]]:
    """Yield cubes of the given colors, numbered within their color: ``cube_red_0`` and so on."""
    numbers = {color: itertools.count() for color in COLORS}
    for color in spawned:
        yield f"cube_{color}_{next(numbers[color])}", color, CUBE_REGION


def plan_motions(cubes: Sequence[SceneObject], *, late: bool) -> tuple[Motion, ...]:
    """Return the motions: binned cubes vanish, and late ones appear after the first of their color.

    As in RoboMME, the place of a late cube may be occupied.
    """
    ranks = {
        cube.name: number
        for color in COLORS
        for number, cube in enumerate(cube for cube in cubes if cube.color == color)
    }
    appearing = [
        Away(name, 0, APPEAR_STEPS * number) for name, number in ranks.items() if late and number
    ]
    return (
        *appearing,
        *(Vanish(cube, fact) for cube, fact in zip(ranks, _binned(ranks), strict=True)),
    )


def goals(scene: Scene) -> tuple[Goal, ...]:
    """Return all goals of up to five cubes in all, at most the present ones of each color."""
    colors = [color for color in GOAL_ORDER if _of_color(scene, color)]
    choices = [range(len(_of_color(scene, color)) + 1) for color in colors]
    found: list[Goal] = []
    for counts in itertools.product(*choices):
        if 1 <= sum(counts) <= MAX_GOAL_CUBES:
            named = [pair for pair in zip(colors, counts, strict=True) if pair[1]]
            goal = Goal.of(
                colors=tuple(str(color) for color, _ in named),
                counts=tuple(count for _, count in named),
            )
            found.append(goal)
    return tuple(found)


def stages(scene: Scene, goal: Goal) -> tuple[Stage, ...]:
    """Return 2 N + 1 stages: pick and put in once for each of N cubes, then press.

    Any cube completes a stage; the colors are judged when N are in.
    """
    cubes = [cube.name for cube in scene.of_kind("cube")]
    picked, binned = tuple(Fact("picked", cube) for cube in cubes), _binned(cubes)
    plan: list[Stage] = []
    for drops, (color, ordinal, cube) in enumerate(_wanted(scene, goal), start=1):
        pick = Stage(
            expects=FactCount(picked),
            forbids=(PRESSED,),
            primitive=Primitive("pick_cube", cube),
            subgoal=f"pick up the {ordinal} {color} cube {{at}}",
            points_at=cube,
        )
        put_in = Stage(
            expects=FactCount(binned, least=drops),
            forbids=(PRESSED,),
            primitive=Primitive("drop_into", cube, "bin"),
            subgoal="put it into the bin {at}",
            points_at="bin",
        )
        plan += [pick, put_in]
    return (*plan, press_stage(forbids=tuple(_wrong_counts(scene, goal))))


def _wanted(scene: Scene, goal: Goal) -> Iterator[tuple[str, str, str]]:
    """Yield color, ordinal and name of the cubes that the oracle takes, color by color."""
    counts = dict(goal.amounts)
    for color in dict.fromkeys((*scene.color_order, *counts)):
        cubes = _of_color(scene, color)[: counts.get(color, 0)]
        for ordinal, cube in zip(ORDINALS, cubes, strict=False):
            yield color, ordinal, cube


def _wrong_counts(scene: Scene, goal: Goal) -> Iterator[Rule]:
    """Yield rules against more cubes in the bin than the goal's, and fewer, for each color."""
    wanted = dict(goal.amounts)
    for color in GOAL_ORDER:
        binned, count = _binned(_of_color(scene, color)), wanted.get(color, 0)
        if not binned:
            continue
        if count == 0:
            yield Rule(FactCount(binned), f"put a {color} cube into the bin", "wrong_object")
            continue
        cubes = f"{counted(count, f'{color} cube')} into the bin"
        more, fewer = FactCount(binned, least=count + 1), FactCount(binned, 0, count - 1)
        too_few = f"fewer than {cubes}" if count > 1 else f"no {color} cube into the bin"
        yield Rule(more, f"put more than {cubes}", "wrong_count")
        yield Rule(fewer, f"put {too_few}", "wrong_count")


def _of_color(scene: Scene, color: str) -> list[str]:
    """Return the names of all cubes of a color, as numbered."""
    return [cube.name for cube in scene.of_kind("cube") if cube.color == color]


def _binned(cubes: Iterable[str]) -> tuple[Fact, ...]:
    return tuple(Fact("binned", cube, "bin") for cube in cubes)


COMMANDS = Commands(
    by_place="cube[|s] like the one {place}",
    by_rank="cube[|s] like {place}",
    wordings=command_pools(
        train=(
            "Put {cubes} into the bin and press the button.",
            "Drop {cubes} into the bin and press the button.",
            "Place {cubes} in the bin and press the button.",
        ),
        test=(
            "Move {cubes} into the bin and push the button.",
            "Toss {cubes} into the bin and push the button.",
            "Throw {cubes} in the bin and press the button.",
        ),
    ),
)

TASK = Task(
    name="BinFill",
    suite="counting",
    code=4,
    spatial=True,
    sample=sample,
    goals=goals,
    stages=stages,
    commands=COMMANDS,
    words="BinFill.toml",
)
