"""Shared by the Unmask tasks in which containers change places with their cubes."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from roboirg.core.episode import COLORS, Difficulty, Scene, SceneObject
from roboirg.core.footprints import Footprint, Region
from roboirg.core.motions import Away, Motion
from roboirg.tasks.shared.fixtures import Bounds, draw_number
from roboirg.tasks.shared.swapping import last_step, plan_swaps
from roboirg.tasks.shared.unmask import appearing, draw_containers_in, goal_of, hide_cubes
from roboirg.tasks.task import SceneAndGoal
from roboirg.util.random_draws import draw, shuffled

CONTAINERS: dict[Difficulty, int] = {"easy": 3, "medium": 4, "hard": 4}
SWAPS: dict[Difficulty, Bounds] = {"easy": (1, 2), "medium": (1, 2), "hard": (2, 3)}
PICKS: dict[Difficulty, Bounds] = {"easy": (1, 2), "medium": (1, 1), "hard": (2, 2)}
"""Fewest and most swaps and picks; both numbers are uniform."""
START = 64
LANE = 0.07
SPOT_HALF = 0.07
"""Half side of the square around a layout point in which a container stands, m."""
SPOT_GAP = 0.02


def draw_containers_about(
    rng: np.random.Generator,
    points: Iterable[tuple[float, float]],
    obstacles: Sequence[Footprint] = (),
) -> list[SceneObject]:
    """Draw a container near each point of a layout; see `draw_containers_in`."""
    regions = [Region(x, y, SPOT_HALF, SPOT_HALF) for x, y in points]
    return draw_containers_in(rng, regions, SPOT_GAP, obstacles)


def sample(
    rng: np.random.Generator,
    difficulty: Difficulty,
    containers: Sequence[SceneObject],
    buttons: Sequence[SceneObject] = (),
) -> SceneAndGoal:
    """Draw hidden cubes, swaps and goal for containers that have been placed.

    The order of the draws decides which scene a seed gives: the order of the first three
    containers, the cubes under them, the containers that swap, the number of picks. The cubes are
    out of the world while the containers move, and return under their own ones. As in RoboMME, two
    swaps may cancel out.
    """
    covers = shuffled(rng, containers[: len(COLORS)])
    cubes = hide_cubes(rng, covers)
    initiators = _draw_initiators(rng, difficulty, containers)
    picks = draw_number(rng, PICKS[difficulty])
    scene = Scene(
        objects=(*buttons, *containers, *cubes),
        motions=plan_motions(containers, cubes, initiators),
    )
    return scene, goal_of(cubes[:picks])


def plan_motions(
    containers: Sequence[SceneObject], cubes: Sequence[SceneObject], initiators: Sequence[str]
) -> tuple[Motion, ...]:
    """Return all motions: containers appear and swap, the cubes under them are away meanwhile.

    `initiators` are the names of the containers that start a swap, in order; each changes places
    with the nearest other container.
    """
    swaps = plan_swaps(containers, initiators, start=START, lane=LANE)
    end = last_step(swaps)
    away = [Away(cube.name, START, end, under=cube.inside) for cube in cubes]
    # The cubes come last: when they return, their containers have arrived.
    return (*appearing(containers), *swaps, *away)


def _draw_initiators(
    rng: np.random.Generator, difficulty: Difficulty, containers: Sequence[SceneObject]
) -> tuple[str, ...]:
    """Draw the names of the containers that start a swap: two with a cube, then any other one.

    Three are drawn always, and as many of them returned as there are swaps, so that the number of
    swaps changes no later draw.
    """
    swap_count = draw_number(rng, SWAPS[difficulty])
    names = [container.name for container in containers]
    with_cube = names[: len(COLORS)]  # cubes are under the first three
    initiators = shuffled(rng, with_cube)[:2]
    others = [name for name in names if name not in initiators]
    initiators.append(draw(rng, others))
    return tuple(initiators[:swap_count])
