"""Shared by the VideoPlace tasks: their table, their video and their stages.

In the video, one cube is placed on several discs, with a press of the button in between, and then
put back on an invisible site; at the end two discs may change places. The policy places a cube on
one of those discs. Facts: RoboMME.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from roboirg.core import object_sizes
from roboirg.core.conditions import Fact
from roboirg.core.episode import Difficulty, Primitive, Scene, SceneObject, Stage
from roboirg.core.footprints import Obstacle, Region
from roboirg.core.motions import Point, Swap
from roboirg.tasks.shared.fixtures import DiscPlan, disc_area, draw_button_and_cubes, draw_targets
from roboirg.tasks.shared.stages import (
    facts_of_others,
    go_home,
    hold_still,
    pick_stage,
    place_stage,
    press_stage,
    retreat,
)
from roboirg.tasks.shared.swapping import SWAP_START, SWAP_STEPS
from roboirg.util.random_draws import draw, shuffled

BUTTON_REGION = Region(0.1, 0.0, 0.025, 0.15)
SITE_REGION = Region(-0.1, 0.0, 0.1, 0.1)
WORK_REGION = Region(0.0, 0.0, 0.2, 0.2)
GAP = 0.02
TARGET_RADIUS = 0.04

SWAP_LANE = 0.1
HOLD_STEPS = 60


class PlaceTable(NamedTuple):
    """A table before its video.

    Attributes:
        objects: site, button, cubes and discs.
        discs: the target discs; the first is ``target_0``.
        cube: the one that the video shows.
    """

    objects: tuple[SceneObject, ...]
    discs: tuple[SceneObject, ...]
    cube: SceneObject


def draw_table(
    rng: np.random.Generator, difficulty: Difficulty, discs: int, site_radius: float
) -> PlaceTable:
    """Draw site, button, cubes of different colors and target discs, and choose one of the cubes.

    The site is the round place for the cube at the end of the video; its radius is in meters.
    `discs` is the number of target discs.
    """
    site = _draw_site(rng, site_radius)
    placed = draw_button_and_cubes(rng, difficulty, WORK_REGION, GAP, BUTTON_REGION)
    # As in RoboMME, cubes may lie on the site; discs may not.
    obstacles = (*placed.obstacles, disc_area(site))
    targets = _draw_discs(rng, discs, obstacles)
    return PlaceTable(
        objects=(site, placed.button, *placed.cubes, *targets),
        discs=targets,
        cube=draw(rng, placed.cubes),
    )


def _draw_discs(
    rng: np.random.Generator, count: int, obstacles: Sequence[Obstacle]
) -> tuple[SceneObject, ...]:
    """Draw the target discs, ``target_0`` and so on, anywhere away from all obstacles."""
    usual = DiscPlan("", WORK_REGION, TARGET_RADIUS, GAP)
    plans = [usual._replace(name=f"target_{number}") for number in range(count)]
    return tuple(draw_targets(rng, plans, obstacles))


def _draw_site(rng: np.random.Generator, radius: float) -> SceneObject:
    """Draw the round place on which the cube lies at the end of the video."""
    x, y = SITE_REGION.draw(rng, inset=radius)
    # A site is as high as a disc: the release height of the hand follows from it.
    position = Point(x, y, object_sizes.TARGET_HEIGHT)
    return SceneObject("site", "site", position, radius=radius)


def draw_scene(
    rng: np.random.Generator, difficulty: Difficulty, table: PlaceTable, past: tuple[Fact, ...]
) -> Scene:
    """Return the scene of a table and the acts of its video; in hard episodes two discs swap.

    `past` are the acts of the video, in order, as facts: *placed cube_red on target_0*, *pressed*.
    Only in hard episodes is anything drawn: which two discs change places.
    """
    if difficulty != "hard":
        return Scene(table.objects, past=past)
    first, second, *others = (disc.name for disc in shuffled(rng, table.discs))
    swap = plan_swap(first, second, others, past)
    return Scene(table.objects, (swap,), past)


def plan_swap(first: str, second: str, others: Sequence[str], past: Sequence[Fact]) -> Swap:
    """Return the swap of two discs at the end of the video, while the `others` stay.

    It starts with the video's holding stage, whose number follows from the acts of the video,
    `past`.
    """
    kinds = [stage.primitive.kind for stage in _demonstration_of(past)]
    hold = kinds.index("hold")
    return Swap(
        first,
        second,
        start=SWAP_START,
        steps=SWAP_STEPS,
        lane=SWAP_LANE,
        pinned=tuple(others),
        stage=hold,
    )


def visited(scene: Scene) -> tuple[str, ...]:
    """Return the names of the discs on which the video shows the cube placed, in order.

    ``("target_2", "target_0")``, for example; the site where it ends is not among them.
    """
    return tuple(str(fact.place) for fact in scene.past if fact.kind == "placed")


def demonstration(scene: Scene) -> tuple[Stage, ...]:
    """Return the video's stages: all past acts, then put back the cube, wait and go home."""
    return _demonstration_of(scene.past)


def _demonstration_of(past: Sequence[Fact]) -> tuple[Stage, ...]:
    """Return the stages of a video that shows some acts: presses, and placings of one cube.

    *Placed on target_0, pressed* -> pick, place on target_0, press, and then what ends every video:
    put the cube back, move away, hold still, go home.
    """
    plan = []
    cube = ""
    for fact in past:
        if fact.kind == "pressed":
            plan.append(press_stage())
        else:
            cube = fact.subject
            put = "drop the cube onto target {at}"
            plan += [pick_stage(cube), place_stage(cube, str(fact.place), put)]
    put_back = Stage(
        expects=Fact("placed", cube, "site"),
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


def place_stages(scene: Scene, color: str, answer: str) -> tuple[Stage, ...]:
    """Return the stages: pick the cube of a color, and place it on the right disc only.

    `answer` is the name of that disc. Picking another cube, or placing it on another disc, fails
    the episode.
    """
    cube = f"cube_{color}"
    wrong_picks = facts_of_others("picked", scene.of_kind("cube"), cube)
    pick = pick_stage(cube).forbidding(*wrong_picks)
    put = place_stage(cube, answer, "place the cube onto the correct target {at}")
    for disc in scene.of_kind("target"):
        if disc.name != answer:
            put = put.forbidding(Fact("placed", cube, disc.name))
    return pick, put
