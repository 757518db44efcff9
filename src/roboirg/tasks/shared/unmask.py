"""Shared by the Unmask tasks: containers that appear over cubes and are to be lifted."""

from __future__ import annotations

import functools
import itertools
import math
from collections.abc import Iterable, Sequence

import numpy as np

from roboirg.core import object_sizes
from roboirg.core.conditions import Fact
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
from roboirg.core.errors import SceneRejectedError
from roboirg.core.footprints import Circle, Footprint, Region, place
from roboirg.core.motions import Away, Point
from roboirg.core.word_pools import Pools
from roboirg.tasks.shared.fixtures import button_keep_out, footprint
from roboirg.tasks.task import Commands, SceneAndGoal, Wording
from roboirg.util.random_draws import shuffled

APPEAR_STEP = 32
"""The step at which all containers appear over the cubes at once."""
CONTAINERS: dict[Difficulty, int] = {"easy": 3, "medium": 5, "hard": 15}
"""Upper bounds: placement ends at the first container without a free place."""
PICKS: dict[Difficulty, int] = {"easy": 1, "medium": 1, "hard": 2}
REGION = Region(0.0, 0.0, 0.2, 0.2)
GAP = 0.04


def sample(
    rng: np.random.Generator, difficulty: Difficulty, buttons: Sequence[SceneObject] = ()
) -> SceneAndGoal:
    """Draw containers that stay in their places, three over a cube; the first are to be lifted."""
    obstacles = [button_keep_out(button) for button in buttons]
    containers = draw_containers_in(rng, [REGION] * CONTAINERS[difficulty], GAP, obstacles)
    cubes = hide_cubes(rng, containers)
    colors = tuple(str(cube.color) for cube in cubes[: PICKS[difficulty]])
    scene = Scene((*buttons, *containers, *cubes), motions=appearing(containers))
    return scene, Goal.of(colors=colors)


def draw_containers_in(
    rng: np.random.Generator,
    regions: Iterable[Region],
    gap: float,
    obstacles: Sequence[Footprint] = (),
) -> list[SceneObject]:
    """Draw a container in each region, until one has no free place.

    As in RoboMME, the gap in meters counts twice: around the new container and around each placed
    one.
    """
    radius = object_sizes.CONTAINER_HALF + gap
    taken = list(obstacles)
    containers: list[SceneObject] = []
    for index, region in enumerate(regions):
        spot = place(
            functools.partial(region.draw, rng, inset=object_sizes.CONTAINER_HALF),
            lambda spot: Circle(*spot, radius),
            taken,
        )
        if spot is None:
            break
        position = Point(*spot, object_sizes.CONTAINER_HEIGHT)
        yaw = -rng.random() * math.pi / 2
        container = SceneObject(f"container_{index}", "container", position, yaw)
        containers.append(container)
        taken.append(footprint(container).grown(gap))
    return containers


def hide_cubes(
    rng: np.random.Generator, containers: Sequence[SceneObject]
) -> tuple[SceneObject, ...]:
    """Draw a red, a green and a blue cube, in random order under the first three containers."""
    if len(containers) < len(COLORS):
        raise SceneRejectedError("fewer than three containers fit")
    return tuple(map(hidden_cube, shuffled(rng, COLORS), containers))


def hidden_cube(color: Color, container: SceneObject) -> SceneObject:
    """Return the cube of a color under a container."""
    x, y, _ = container.position
    position = Point(x, y, object_sizes.HIDDEN_CUBE_HALF)
    return SceneObject(f"cube_{color}", "hidden_cube", position, 0.0, color, container.name)


def goals(scene: Scene) -> tuple[Goal, ...]:
    """Return a goal for every hidden cube, and for every two of them in order."""
    hidden = [str(cube.color) for cube in scene.of_kind("hidden_cube")]
    single = [(color,) for color in hidden]
    pairs = list(itertools.permutations(hidden, 2))
    return tuple(Goal.of(colors=colors) for colors in (*single, *pairs))


def pick_stages(scene: Scene, goal: Goal) -> tuple[Stage, ...]:
    """Return the stages: lift the container over each goal cube in turn, put it down in between."""
    covers = {cube.color: cube.inside for cube in scene.of_kind("hidden_cube")}
    containers = tuple(item.name for item in scene.of_kind("container"))
    plan: list[Stage] = []
    for color in goal.texts("colors"):
        target = next(str(cover) for hidden, cover in covers.items() if hidden == color)
        wrong = tuple(Fact("lifted", other) for other in containers if other != target)
        if plan:
            plan.append(_put_down(plan[-1].primitive.subject, containers))
        lift = Stage(
            expects=Fact("lifted", target),
            forbids=wrong,
            primitive=Primitive("pick_container", target),
            subgoal=f"pick up the container {{at}} that hides the {color} cube",
            points_at=target,
        )
        plan.append(lift)
    return tuple(plan)


def _put_down(held: str, containers: Sequence[str]) -> Stage:
    return Stage(
        expects=Fact("put_down", held),
        forbids=tuple(Fact("lifted", other) for other in containers if other != held),
        primitive=Primitive("put_down", held),
        subgoal="put down the container",
    )


def appearing(containers: Sequence[SceneObject]) -> tuple[Away, ...]:
    """Return the motions by which every container appears at its place after 32 steps."""
    return tuple(Away(container.name, 0, APPEAR_STEP) for container in containers)


def container_commands(wordings: Pools[Wording]) -> Commands:
    """Return the commands of a task in which the containers stand when the words are said."""
    return Commands(
        thing="container",
        by_color="the container over {cube}",
        by_place="the container {place}",
        pointed="container",
        things_at="the container {place}",
        wordings=wordings,
    )
