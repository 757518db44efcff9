"""Shared by the Unmask tasks: containers that appear over cubes and are to be lifted."""

from __future__ import annotations

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
from roboirg.tasks.shared.fixtures import button_keep_out, footprint
from roboirg.tasks.shared.layouts import PlanePoint
from roboirg.tasks.shared.stages import facts_of_others
from roboirg.tasks.task import GoalThings, SceneAndGoal
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
    """Draw containers that stay in their places, three of them over a cube.

    The goal is the containers over the first cube, in hard episodes over the first two. `buttons`
    are on the table already, and keep containers away.
    """
    regions = [REGION] * CONTAINERS[difficulty]
    obstacles = [button_keep_out(button) for button in buttons]
    containers = draw_containers_in(rng, regions, GAP, obstacles)
    cubes = hide_cubes(rng, containers)
    scene = Scene(
        objects=(*buttons, *containers, *cubes),
        motions=appearing(containers),
    )
    return scene, goal_of(cubes[: PICKS[difficulty]])


def goal_of(cubes: Sequence[SceneObject]) -> Goal:
    """Return the goal of lifting the containers over some cubes, in order.

    The red cube, then the blue one -> ``Goal.of(colors=("red", "blue"))``.
    """
    return Goal.of(colors=tuple(str(cube.color) for cube in cubes))


def draw_containers_in(
    rng: np.random.Generator,
    regions: Iterable[Region],
    gap: float,
    obstacles: Sequence[Footprint] = (),
) -> list[SceneObject]:
    """Draw a container in each region, until one has no free place; the rest are left out.

    As in RoboMME, the gap in meters counts twice: around the new container and around each placed
    one. Returns ``container_0``, ``container_1`` and so on. For each, the place is drawn first,
    then the yaw.
    """
    taken = list(obstacles)
    containers = []
    for index, region in enumerate(regions):
        spot = _free_spot(rng, region, gap, taken)
        if spot is None:
            break
        container = _draw_container(rng, f"container_{index}", spot)
        containers.append(container)
        taken.append(footprint(container).grown(gap))
    return containers


def _draw_container(rng: np.random.Generator, name: str, spot: PlanePoint) -> SceneObject:
    """Draw the yaw of a container that stands at a spot (x, y; meters)."""
    yaw = -rng.random() * math.pi / 2
    return SceneObject(name, "container", Point(*spot, object_sizes.CONTAINER_HEIGHT), yaw)


def _free_spot(
    rng: np.random.Generator, region: Region, gap: float, obstacles: Sequence[Footprint]
) -> PlanePoint | None:
    """Draw where a container can stand in a region (x, y; meters); None without a free place."""

    def draw() -> PlanePoint:
        return region.draw(rng, inset=object_sizes.CONTAINER_HALF)

    def clearance(spot: PlanePoint) -> Circle:
        return Circle(*spot, object_sizes.CONTAINER_HALF + gap)

    return place(draw, clearance, obstacles)


def hide_cubes(
    rng: np.random.Generator, containers: Sequence[SceneObject]
) -> tuple[SceneObject, ...]:
    """Draw a red, a green and a blue cube, in random order under the first three containers.

    Returns the cubes in the order of the containers. Raises SceneRejectedError with fewer than
    three.
    """
    if len(containers) < len(COLORS):
        raise SceneRejectedError("fewer than three containers fit")
    pairs = zip(shuffled(rng, COLORS), containers, strict=False)
    return tuple(hidden_cube(color, container) for color, container in pairs)


def hidden_cube(color: Color, container: SceneObject) -> SceneObject:
    """Return the cube of a color that stands under a container, which its `inside` names."""
    x, y, _ = container.position
    position = Point(x, y, object_sizes.HIDDEN_CUBE_HALF)
    return SceneObject(f"cube_{color}", "hidden_cube", position, 0.0, color, container.name)


def goals(scene: Scene) -> tuple[Goal, ...]:
    """Return a goal for every hidden cube, and for every two of them in order.

    Three cubes give nine goals: *red*, *green*, …, *red then green*, *green then red*, …
    """
    cubes = scene.of_kind("hidden_cube")
    choices = [*itertools.permutations(cubes, 1), *itertools.permutations(cubes, 2)]
    return tuple(goal_of(choice) for choice in choices)


def pick_stages(scene: Scene, goal: Goal) -> tuple[Stage, ...]:
    """Return the stages: lift the container over each goal cube in turn, put it down in between.

    Red, then blue -> lift the container over the red cube, put it down, lift that over the blue
    one, which stays in the hand. Lifting any other container is forbidden: it fails the episode.
    """
    container_over = {str(cube.color): str(cube.inside) for cube in scene.of_kind("hidden_cube")}
    containers = scene.of_kind("container")
    plan: list[Stage] = []
    for color in goal.texts("colors"):
        if plan:
            held = plan[-1].primitive.subject
            plan.append(_put_down(held, containers))
        target = container_over[color]
        lift = Stage(
            expects=Fact("lifted", target),
            forbids=facts_of_others("lifted", containers, target),
            primitive=Primitive("pick_container", target),
            subgoal=f"pick up the container {{at}} that hides the {color} cube",
            points_at=target,
        )
        plan.append(lift)
    return tuple(plan)


def _put_down(held: str, containers: Sequence[SceneObject]) -> Stage:
    """Return the stage in which the container in the hand, named `held`, is put down.

    Meanwhile, lifting any other one fails the episode.
    """
    return Stage(
        expects=Fact("put_down", held),
        forbids=facts_of_others("lifted", containers, held),
        primitive=Primitive("put_down", held),
        subgoal="put down the container",
    )


def appearing(containers: Sequence[SceneObject]) -> tuple[Away, ...]:
    """Return the motions by which every container appears at its place after 32 steps."""
    return tuple(Away(container.name, 0, APPEAR_STEP) for container in containers)


CONTAINER_THINGS = GoalThings(handled="container", pointed="container")
"""Of tasks in which the containers stand when the words are said."""
HIDDEN_CUBE_THINGS = CONTAINER_THINGS._replace(pointed="hidden_cube")
"""Of tasks in which only the cubes are there when the words are said."""
