"""BinFill: put so many cubes of each named color into the bin, then press the button.

Counting suite. A cube that falls into the bin is gone, so what has been put in cannot be seen; in
half of the episodes only one cube of each color is there at first. Only the numbers are judged,
not the order. Facts: RoboMME, where the oracle shuffles the colors; here it takes them in the
order of the goal.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Iterator

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
from roboirg.core.motions import Away, Motion, Vanish
from roboirg.tasks.shared.fixtures import (
    ORDINALS,
    bin_footprint,
    button_footprint,
    button_keep_out,
    cube_footprint,
    draw_bin,
    draw_button,
    draw_cube,
    draw_number,
)
from roboirg.tasks.shared.placement import Footprint, Region
from roboirg.tasks.task import Commands, Task, Wording

COLORS_PRESENT: dict[Difficulty, int] = {"easy": 1, "medium": 2, "hard": 3}
CUBES: dict[Difficulty, tuple[int, int]] = {"easy": (4, 6), "medium": (8, 10), "hard": (10, 12)}
GOAL_COLORS: dict[Difficulty, tuple[int, int]] = {
    "easy": (1, 1),
    "medium": (1, 2),
    "hard": (2, 3),
}
"""Colors among which the wanted cubes are dealt out; one may get none."""
GOAL_CUBES: dict[Difficulty, tuple[int, int]] = {"easy": (1, 3), "medium": (2, 4), "hard": (3, 5)}
MAX_GOAL_CUBES = 5
GOAL_ORDER: tuple[Color, ...] = ("red", "blue", "green")

BUTTON_REGION = Region(-0.2, 0.0, 0.05, 0.2)
BIN_REGION = Region(0.05, 0.0, 0.1, 0.2)
CUBE_REGION = Region(-0.1, 0.0, 0.2, 0.25)
CUBE_GAP = 0.02
APPEAR_STEPS = 50
"""Late cubes of a color appear one after the other, so many control steps apart."""


def sample(rng: np.random.Generator, difficulty: Difficulty) -> tuple[Scene, Goal]:
    """Button, bin and cubes of one to three colors, of some of which a few are wanted."""
    late = bool(rng.integers(2))
    button = draw_button(rng, BUTTON_REGION)
    # RoboMME places the bin without looking at the button; here its walls stay off the base.
    bin_ = draw_bin(rng, BIN_REGION, [button_footprint(button)])
    present = [COLORS[index] for index in rng.permutation(len(COLORS))]
    present = present[: COLORS_PRESENT[difficulty]]
    wanted = _draw_wanted(rng, difficulty, present)
    spawned = _draw_spawned(rng, difficulty, present, wanted)
    cubes = _draw_cubes(rng, spawned, [button_keep_out(button), bin_footprint(bin_)])
    named = tuple(color for color in GOAL_ORDER if wanted.get(color))
    goal = Goal.of(colors=named, counts=tuple(wanted[color] for color in named))
    return Scene((button, bin_, *cubes), _motions(cubes, late=late)), goal


def _draw_wanted(
    rng: np.random.Generator, difficulty: Difficulty, present: list[Color]
) -> dict[Color, int]:
    """How many cubes of each color that is present are to go into the bin."""
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
    """A color for each cube, shuffled: enough of what is wanted, one at least of each present."""
    spawned = [color for color in present for _ in range(max(wanted[color], 1))]
    left = draw_number(rng, CUBES[difficulty]) - len(spawned)
    spawned += [present[index] for index in rng.integers(len(present), size=left)]
    return [spawned[index] for index in rng.permutation(len(spawned))]


def _draw_cubes(
    rng: np.random.Generator, spawned: list[Color], obstacles: list[Footprint]
) -> list[SceneObject]:
    """Cubes of the given colors, numbered within their color: ``cube_red_0`` and so on."""
    taken = list(obstacles)
    cubes: list[SceneObject] = []
    numbers = {color: itertools.count() for color in COLORS}
    for color in spawned:
        name = f"cube_{color}_{next(numbers[color])}"
        cube = draw_cube(rng, name, color, CUBE_REGION, CUBE_GAP, taken)
        cubes.append(cube)
        taken.append(cube_footprint(cube))
    return cubes


def _motions(cubes: list[SceneObject], *, late: bool) -> tuple[Motion, ...]:
    """Binned cubes vanish; late ones appear, the first of each color being there from the start.

    As in RoboMME nobody makes sure that the place of a late cube is still free.
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
    """Up to five cubes in all, of each color as many as there are at most."""
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
    """Pick and put in, once for each wanted cube, then press: 2 N + 1 stages.

    Any cube completes a stage; whether the colors are right is judged when all are in.
    """
    cubes = [cube.name for cube in scene.of_kind("cube")]
    picked, binned = tuple(Fact("picked", cube) for cube in cubes), _binned(cubes)
    pressed = Fact("pressed", "button")
    plan: list[Stage] = []
    for drops, (color, ordinal, cube) in enumerate(_wanted(scene, goal), start=1):
        pick = Stage(
            expects=FactCount(picked),
            forbids=(pressed,),
            primitive=Primitive("pick_cube", cube),
            subgoal=f"pick up the {ordinal} {color} cube {{at}}",
            points_at=cube,
        )
        put_in = Stage(
            expects=FactCount(binned, least=drops),
            forbids=(pressed,),
            primitive=Primitive("drop_into", cube, "bin"),
            subgoal="put it into the bin {at}",
            points_at="bin",
        )
        plan += [pick, put_in]
    press = Stage(
        expects=pressed,
        forbids=tuple(_wrong_counts(scene, goal)),
        primitive=Primitive("press", "button"),
        subgoal="press the button {at} to stop",
        points_at="button",
    )
    return (*plan, press)


def _wanted(scene: Scene, goal: Goal) -> Iterator[tuple[str, str, str]]:
    """Color, ordinal and name of the cubes that the oracle takes, in the order of appearance."""
    for color, count in zip(goal.texts("colors"), goal.numbers("counts"), strict=True):
        cubes = _of_color(scene, color)[:count]
        for ordinal, cube in zip(ORDINALS, cubes, strict=False):
            yield color, ordinal, cube


def _wrong_counts(scene: Scene, goal: Goal) -> Iterator[Rule]:
    """For each color that is present: more in the bin than wanted, or fewer."""
    wanted = dict(zip(goal.texts("colors"), goal.numbers("counts"), strict=True))
    for color in GOAL_ORDER:
        binned, count = _binned(_of_color(scene, color)), wanted.get(color, 0)
        if not binned:
            continue
        things = f"{count} {color} cube{'' if count == 1 else 's'} in the bin"
        if count == 0:
            yield Rule(FactCount(binned), f"a {color} cube in the bin", "wrong_object")
        else:
            yield Rule(FactCount(binned, least=count + 1), f"more than {things}", "wrong_count")
            fewer = FactCount(binned, least=0, most=count - 1)
            yield Rule(fewer, f"fewer than {things}", "wrong_count")


def _of_color(scene: Scene, color: str) -> list[str]:
    """Names of all cubes of a color, as numbered."""
    return [cube.name for cube in scene.of_kind("cube") if cube.color == color]


def _binned(cubes: Iterable[str]) -> tuple[Fact, ...]:
    return tuple(Fact("binned", cube, "bin") for cube in cubes)


COMMANDS = Commands(
    by_place="cube[|s] of the same color as the one {place}",
    patterns=("color exclusion", "number deduction", "contextual logic"),
    wordings=(
        Wording("Put {cubes} into the bin, then press the button to stop."),
        Wording("Drop {cubes} into the bin, and press the button when you are done."),
        Wording("I want you to place {cubes} into the bin, and to press the button at the end."),
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
)
