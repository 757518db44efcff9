"""Shared by the VideoPlace tasks: their table, their video and their stages.

In the video, one cube is placed on several discs, with a press of the button in between, and then
put back on an invisible site; at the end two discs may change places. The policy places a cube on
one of those discs. Facts: RoboMME.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from roboirg.core import object_sizes
from roboirg.core.conditions import Fact
from roboirg.core.episode import Difficulty, Primitive, Scene, SceneObject, Stage
from roboirg.core.footprints import Circle, Region
from roboirg.core.motions import Point, Swap
from roboirg.tasks.shared.fixtures import draw_button_and_cubes, draw_target
from roboirg.tasks.shared.stages import (
    go_home,
    hold_still,
    pick_stage,
    place_stage,
    press_stage,
    retreat,
)
from roboirg.tasks.shared.swapping import SWAP_START, SWAP_STEPS
from roboirg.util.random_draws import draw, shuffled

CUBES: dict[Difficulty, int] = {"easy": 1, "medium": 3, "hard": 3}

BUTTON_REGION = Region(0.1, 0.0, 0.025, 0.15)
SITE_REGION = Region(-0.1, 0.0, 0.1, 0.1)
WORK_REGION = Region(0.0, 0.0, 0.2, 0.2)
GAP = 0.02
TARGET_RADIUS = 0.04

SWAP_LANE = 0.1
HOLD_STEPS = 60


def draw_table(
    rng: np.random.Generator, cubes: int, discs: int, site_radius: float
) -> tuple[Scene, SceneObject]:
    """Draw site, button, cubes of different colors and target discs, and choose one of the cubes.

    The first disc is ``target_0``.
    The site is the round place for the cube at the end of the video; its radius is in meters.
    """
    x, y = SITE_REGION.draw(rng, inset=site_radius)
    # A site is as high as a disc: the release height of the hand follows from it.
    site = SceneObject("site", "site", Point(x, y, object_sizes.TARGET_HEIGHT), radius=site_radius)
    button, colored, obstacles = draw_button_and_cubes(rng, BUTTON_REGION, cubes, WORK_REGION, GAP)
    # As in RoboMME, cubes may lie on the site; discs may not.
    obstacles.append(Circle(x, y, site_radius))
    objects: list[SceneObject] = [site, button, *colored]
    for number in range(discs):
        disc = draw_target(rng, f"target_{number}", TARGET_RADIUS, WORK_REGION, GAP, obstacles)
        objects.append(disc)
        obstacles.append(Circle(disc.position.x, disc.position.y, TARGET_RADIUS))
    return Scene(tuple(objects)), draw(rng, colored)


def draw_swap(rng: np.random.Generator, discs: Sequence[SceneObject], past: Sequence[Fact]) -> Swap:
    """Draw two discs that change places when the robot holds still at the end of the video."""
    first, second, *others = (disc.name for disc in shuffled(rng, discs))
    return plan_swap(first, second, others, past)


def plan_swap(first: str, second: str, others: Sequence[str], past: Sequence[Fact]) -> Swap:
    """Return the swap of two discs at the end of the video, while the others stay."""
    kinds = [stage.primitive.kind for stage in _demonstration_of(past)]
    hold = kinds.index("hold")
    return Swap(first, second, SWAP_START, SWAP_STEPS, SWAP_LANE, pinned=tuple(others), stage=hold)


def visited(scene: Scene) -> tuple[str, ...]:
    """Return the names of the discs on which the video shows the cube placed, in order."""
    return tuple(str(fact.place) for fact in scene.past if fact.kind == "placed")


def demonstration(scene: Scene) -> tuple[Stage, ...]:
    """Return the video's stages: all past acts, then put back the cube, wait and go home."""
    return _demonstration_of(scene.past)


def _demonstration_of(past: Sequence[Fact]) -> tuple[Stage, ...]:
    cube = next(fact.subject for fact in past if fact.kind == "placed")
    plan: list[Stage] = []
    for fact in past:
        plan += [press_stage()] if fact.kind == "pressed" else _show_placing(fact)
    put_back = Stage(
        expects=Fact("placed", cube, "site"),
        forbids=(),
        primitive=Primitive("place_on", cube, "site"),
        subgoal="drop the cube onto table",
    )
    return (
        *plan,
        pick_stage(cube),
        put_back,
        retreat(),
        hold_still(HOLD_STEPS),
        go_home(),
    )


def _show_placing(placed: Fact) -> list[Stage]:
    put = place_stage(placed.subject, str(placed.place), "drop the cube onto target {at}")
    return [pick_stage(placed.subject), put]


def place_stages(scene: Scene, color: str, answer: str) -> tuple[Stage, ...]:
    """Return the stages: pick the cube of a color, and place it on the right disc only."""
    cube = f"cube_{color}"
    cubes = (item.name for item in scene.of_kind("cube"))
    discs = (item.name for item in scene.of_kind("target"))
    wrong_cubes = tuple(Fact("picked", other) for other in cubes if other != cube)
    wrong_discs = tuple(Fact("placed", cube, other) for other in discs if other != answer)
    put = "place the cube onto the correct target {at}"
    return pick_stage(cube, forbids=wrong_cubes), place_stage(cube, answer, put, wrong_discs)


def colors_of(scene: Scene) -> tuple[str, ...]:
    """Return the colors of the cubes on the table."""
    return tuple(str(cube.color) for cube in scene.of_kind("cube"))
