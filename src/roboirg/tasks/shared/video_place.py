"""What the two Place tasks share: their table, their video, and the placing that it asks for.

In the video of a Place task one cube is put on several discs, with a press of the button in
between, and at last put back on a site that nobody sees; then two discs may change places. The
policy puts a cube on one of those discs. Unlike in RoboMME the site stays free of other things, so
that the cube is never put back on another one. Facts: RoboMME.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from roboirg.core import object_sizes
from roboirg.core.conditions import Fact
from roboirg.core.episode import Difficulty, Primitive, Scene, SceneObject, Stage
from roboirg.core.motions import Point, Swap
from roboirg.tasks.shared import video_stages
from roboirg.tasks.shared.fixtures import (
    button_keep_out,
    cube_footprint,
    draw_button,
    draw_colored_cubes,
    draw_target,
)
from roboirg.tasks.shared.placement import Circle, Footprint, Region
from roboirg.tasks.shared.swapping import SWAP_STEPS

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
) -> tuple[SceneObject, ...]:
    """Site, button, cubes of different colors and target discs.

    Args:
        rng: of the episode.
        cubes: how many, one of a color.
        discs: how many, ``target_0`` first.
        site_radius: of the round place for the cube at the end of the video, m.

    Raises:
        SceneRejectedError: no free place was found for one of them.
    """
    x, y = SITE_REGION.draw(rng, inset=site_radius)
    # A site is as high as a disc: the height at which a hand lets go follows from it.
    site = SceneObject("site", "site", Point(x, y, object_sizes.TARGET_HEIGHT), radius=site_radius)
    button = draw_button(rng, BUTTON_REGION)
    obstacles: list[Footprint] = [Circle(x, y, site_radius), button_keep_out(button)]
    colored = draw_colored_cubes(rng, cubes, WORK_REGION, GAP, obstacles)
    obstacles += [cube_footprint(cube) for cube in colored]
    things: list[SceneObject] = [site, button, *colored]
    for number in range(discs):
        disc = draw_target(rng, f"target_{number}", TARGET_RADIUS, WORK_REGION, GAP, obstacles)
        things.append(disc)
        obstacles.append(Circle(disc.position.x, disc.position.y, TARGET_RADIUS))
    return tuple(things)


def draw_swap(rng: np.random.Generator, discs: Sequence[SceneObject], past: Sequence[Fact]) -> Swap:
    """Any two of the discs change places once the robot holds still after all it has shown."""
    first, second, *others = (discs[index].name for index in rng.permutation(len(discs)))
    kinds = [stage.primitive.kind for stage in _demonstration_of(past)]
    hold = kinds.index("hold")
    return Swap(first, second, 0, SWAP_STEPS, SWAP_LANE, pinned=tuple(others), stage=hold)


def visited(scene: Scene) -> tuple[str, ...]:
    """Names of the discs on which the video shows the cube being placed, in order."""
    return tuple(str(fact.place) for fact in scene.past if fact.kind == "placed")


def demonstration(scene: Scene) -> tuple[Stage, ...]:
    """All that the video shows, then the cube is put back and the robot waits and goes home."""
    return _demonstration_of(scene.past)


def _demonstration_of(past: Sequence[Fact]) -> tuple[Stage, ...]:
    cube = next(fact.subject for fact in past if fact.kind == "placed")
    plan: list[Stage] = []
    for fact in past:
        plan += [_show_press(fact)] if fact.kind == "pressed" else _show_placing(fact)
    put_back = Stage(
        expects=Fact("placed", cube, "site"),
        forbids=(),
        primitive=Primitive("place_on", cube, "site"),
        subgoal="drop the cube onto table",
    )
    return (
        *plan,
        video_stages.show_pick(cube),
        put_back,
        video_stages.retreat(),
        video_stages.hold_still(HOLD_STEPS),
        video_stages.go_home(),
    )


def _show_placing(placed: Fact) -> list[Stage]:
    disc = str(placed.place)
    put = Stage(
        expects=placed,
        forbids=(),
        primitive=Primitive("place_on", placed.subject, disc),
        subgoal="drop the cube onto target {at}",
        points_at=disc,
    )
    return [video_stages.show_pick(placed.subject), put]


def _show_press(pressed: Fact) -> Stage:
    return Stage(
        expects=pressed,
        forbids=(),
        primitive=Primitive("press", pressed.subject),
        subgoal="press the button {at}",
        points_at=pressed.subject,
    )


def place_stages(scene: Scene, color: str, answer: str) -> tuple[Stage, ...]:
    """Pick the cube of a color and place it on one disc, and on no other."""
    cube = f"cube_{color}"
    cubes = (item.name for item in scene.of_kind("cube"))
    discs = (item.name for item in scene.of_kind("target"))
    pick = Stage(
        expects=Fact("picked", cube),
        forbids=tuple(Fact("picked", other) for other in cubes if other != cube),
        primitive=Primitive("pick_cube", cube),
        subgoal="pick up the cube {at}",
        points_at=cube,
    )
    put = Stage(
        expects=Fact("placed", cube, answer),
        forbids=tuple(Fact("placed", cube, other) for other in discs if other != answer),
        primitive=Primitive("place_on", cube, answer),
        subgoal="place the cube onto the correct target {at}",
        points_at=answer,
    )
    return pick, put


def colors_of(scene: Scene) -> tuple[str, ...]:
    """The colors of the cubes on the table."""
    return tuple(str(cube.color) for cube in scene.of_kind("cube"))
