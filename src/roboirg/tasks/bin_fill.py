"""BinFill: put so many cubes of each named colour into the bin, then press the button.

Counting suite. A cube that falls into the bin is gone, so what has been put in cannot be seen; in
half of the episodes only one cube of each colour is there at first. Only the numbers are judged,
not the order. Facts: RoboMME, where the oracle shuffles the colours; here it takes them in the
order of the goal.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Iterator

import numpy as np

from roboirg.core.conditions import Count, Fact, Rule
from roboirg.core.episode import (
    COLOURS,
    Colour,
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

COLOURS_PRESENT: dict[Difficulty, int] = {"easy": 1, "medium": 2, "hard": 3}
CUBES: dict[Difficulty, tuple[int, int]] = {"easy": (4, 6), "medium": (8, 10), "hard": (10, 12)}
GOAL_COLOURS: dict[Difficulty, tuple[int, int]] = {
    "easy": (1, 1),
    "medium": (1, 2),
    "hard": (2, 3),
}
"""Colours among which the wanted cubes are dealt out; one may get none."""
GOAL_CUBES: dict[Difficulty, tuple[int, int]] = {"easy": (1, 3), "medium": (2, 4), "hard": (3, 5)}
MAX_GOAL_CUBES = 5
GOAL_ORDER: tuple[Colour, ...] = ("red", "blue", "green")

BUTTON_REGION = Region(-0.2, 0.0, 0.05, 0.2)
BIN_REGION = Region(0.05, 0.0, 0.1, 0.2)
CUBE_REGION = Region(-0.1, 0.0, 0.2, 0.25)
CUBE_GAP = 0.02
APPEAR_STEPS = 50
"""Late cubes of a colour appear one after the other, so many control steps apart."""


def sample(rng: np.random.Generator, difficulty: Difficulty) -> tuple[Scene, Goal]:
    """Button, bin and cubes of one to three colours, of some of which a few are wanted."""
    late = bool(rng.integers(2))
    button = draw_button(rng, BUTTON_REGION)
    # RoboMME places the bin without looking at the button; here its walls stay off the base.
    bin_ = draw_bin(rng, BIN_REGION, [button_footprint(button)])
    present = [COLOURS[index] for index in rng.permutation(len(COLOURS))]
    present = present[: COLOURS_PRESENT[difficulty]]
    wanted = _draw_wanted(rng, difficulty, present)
    spawned = _draw_spawned(rng, difficulty, present, wanted)
    cubes = _draw_cubes(rng, spawned, [button_keep_out(button), bin_footprint(bin_)])
    named = tuple(colour for colour in GOAL_ORDER if wanted.get(colour))
    goal = Goal.of(colours=named, counts=tuple(wanted[colour] for colour in named))
    return Scene((button, bin_, *cubes), _motions(cubes, late=late)), goal


def _draw_wanted(
    rng: np.random.Generator, difficulty: Difficulty, present: list[Colour]
) -> dict[Colour, int]:
    """How many cubes of each colour that is present are to go into the bin."""
    candidates = draw_number(rng, GOAL_COLOURS[difficulty])
    total = draw_number(rng, GOAL_CUBES[difficulty])
    wanted = dict.fromkeys(present, 0)
    for index in rng.integers(candidates, size=total):
        wanted[present[index]] += 1
    return wanted


def _draw_spawned(
    rng: np.random.Generator,
    difficulty: Difficulty,
    present: list[Colour],
    wanted: dict[Colour, int],
) -> list[Colour]:
    """A colour for each cube, shuffled: enough of what is wanted, one at least of each present."""
    spawned = [colour for colour in present for _ in range(max(wanted[colour], 1))]
    left = draw_number(rng, CUBES[difficulty]) - len(spawned)
    spawned += [present[index] for index in rng.integers(len(present), size=left)]
    return [spawned[index] for index in rng.permutation(len(spawned))]


def _draw_cubes(
    rng: np.random.Generator, spawned: list[Colour], obstacles: list[Footprint]
) -> list[SceneObject]:
    """Cubes of the given colours, numbered within their colour: ``cube_red_0`` and so on."""
    taken = list(obstacles)
    cubes: list[SceneObject] = []
    numbers = {colour: itertools.count() for colour in COLOURS}
    for colour in spawned:
        name = f"cube_{colour}_{next(numbers[colour])}"
        cube = draw_cube(rng, name, colour, CUBE_REGION, CUBE_GAP, taken)
        cubes.append(cube)
        taken.append(cube_footprint(cube))
    return cubes


def _motions(cubes: list[SceneObject], *, late: bool) -> tuple[Motion, ...]:
    """Binned cubes vanish; late ones appear, the first of each colour being there from the start.

    As in RoboMME nobody makes sure that the place of a late cube is still free.
    """
    ranks = {
        cube.name: number
        for colour in COLOURS
        for number, cube in enumerate(cube for cube in cubes if cube.colour == colour)
    }
    appearing = [
        Away(name, 0, APPEAR_STEPS * number) for name, number in ranks.items() if late and number
    ]
    return (
        *appearing,
        *(Vanish(cube, fact) for cube, fact in zip(ranks, _binned(ranks), strict=True)),
    )


def goals(scene: Scene) -> tuple[Goal, ...]:
    """Up to five cubes in all, of each colour as many as there are at most."""
    colours = [colour for colour in GOAL_ORDER if _of_colour(scene, colour)]
    choices = [range(len(_of_colour(scene, colour)) + 1) for colour in colours]
    found: list[Goal] = []
    for counts in itertools.product(*choices):
        if 1 <= sum(counts) <= MAX_GOAL_CUBES:
            named = [pair for pair in zip(colours, counts, strict=True) if pair[1]]
            goal = Goal.of(
                colours=tuple(str(colour) for colour, _ in named),
                counts=tuple(count for _, count in named),
            )
            found.append(goal)
    return tuple(found)


def stages(scene: Scene, goal: Goal) -> tuple[Stage, ...]:
    """Pick and put in, once for each wanted cube, then press: 2 N + 1 stages.

    Any cube completes a stage; whether the colours are right is judged when all are in.
    """
    cubes = [cube.name for cube in scene.of_kind("cube")]
    picked, binned = tuple(Fact("picked", cube) for cube in cubes), _binned(cubes)
    pressed = Fact("pressed", "button")
    plan: list[Stage] = []
    for drops, (colour, ordinal, cube) in enumerate(_wanted(scene, goal), start=1):
        pick = Stage(
            expects=Count(picked),
            forbids=(pressed,),
            primitive=Primitive("pick_cube", cube),
            subgoal=f"pick up the {ordinal} {colour} cube {{at}}",
            points_at=cube,
        )
        put_in = Stage(
            expects=Count(binned, least=drops),
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
    """Colour, ordinal and name of the cubes that the oracle takes, in the order of appearance."""
    for colour, count in zip(goal.texts("colours"), goal.numbers("counts"), strict=True):
        cubes = _of_colour(scene, colour)[:count]
        for ordinal, cube in zip(ORDINALS, cubes, strict=False):
            yield colour, ordinal, cube


def _wrong_counts(scene: Scene, goal: Goal) -> Iterator[Rule]:
    """For each colour that is present: more in the bin than wanted, or fewer."""
    wanted = dict(zip(goal.texts("colours"), goal.numbers("counts"), strict=True))
    for colour in GOAL_ORDER:
        binned, count = _binned(_of_colour(scene, colour)), wanted.get(colour, 0)
        if not binned:
            continue
        things = f"{count} {colour} cube{'' if count == 1 else 's'} in the bin"
        if count == 0:
            yield Rule(Count(binned), f"a {colour} cube in the bin", "wrong_object")
        else:
            yield Rule(Count(binned, least=count + 1), f"more than {things}", "wrong_count")
            fewer = Count(binned, least=0, most=count - 1)
            yield Rule(fewer, f"fewer than {things}", "wrong_count")


def _of_colour(scene: Scene, colour: str) -> list[str]:
    """Names of all cubes of a colour, as numbered."""
    return [cube.name for cube in scene.of_kind("cube") if cube.colour == colour]


def _binned(cubes: Iterable[str]) -> tuple[Fact, ...]:
    return tuple(Fact("binned", cube, "bin") for cube in cubes)


COMMANDS = Commands(
    by_place="cube[|s] of the same color as the one {place}",
    patterns=("colour exclusion", "number deduction", "contextual logic"),
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
