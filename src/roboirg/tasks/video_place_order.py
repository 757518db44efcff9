"""VideoPlaceOrder: place the cube on the disc on which it was first, second, ... placed.

Reference suite. The video shows a cube placed on two to four discs in turn, with a press of the
button somewhere in between or afterwards, and put back; in hard episodes two discs change places at
its end. Facts: RoboMME.
"""

from __future__ import annotations

import numpy as np

from roboirg.core.conditions import Fact
from roboirg.core.episode import Difficulty, Goal, Scene, Stage
from roboirg.tasks.shared import video_place
from roboirg.tasks.shared.fixtures import draw_number, goals_by_color
from roboirg.tasks.shared.stages import PRESSED
from roboirg.tasks.shared.video_place import PlaceTable
from roboirg.tasks.task import SceneAndGoal, Task
from roboirg.util.random_draws import shuffled

DISCS = 4
PLACEMENTS = (2, 4)
"""Fewest and most discs that the cube visits."""
SITE_RADIUS = 0.1


def sample(rng: np.random.Generator, difficulty: Difficulty) -> SceneAndGoal:
    """Draw the visited discs, their order, the goal's disc and the time of the press.

    The press comes after the first placing at the earliest, and after the last at the latest. The
    order of the draws decides which scene a seed gives: the goal's disc before the press.
    """
    table = video_place.draw_table(rng, difficulty, DISCS, SITE_RADIUS)
    shown = _draw_placings(rng, table)
    first_to_last = (1, len(shown))
    placement = draw_number(rng, first_to_last)
    pressed_after = draw_number(rng, first_to_last)
    past = (*shown[:pressed_after], PRESSED, *shown[pressed_after:])
    scene = video_place.draw_scene(rng, difficulty, table, past)
    goal = Goal.of(color=str(table.cube.color), placement=placement)
    return scene, goal


def _draw_placings(rng: np.random.Generator, table: PlaceTable) -> list[Fact]:
    """Draw on how many discs, and on which ones in turn, the video shows the cube placed."""
    placements = draw_number(rng, PLACEMENTS)
    discs = shuffled(rng, table.discs)[:placements]
    return [Fact("placed", table.cube.name, disc.name) for disc in discs]


def goals(scene: Scene) -> tuple[Goal, ...]:
    """Return a goal for every cube and every disc that was visited, counted from 1."""
    placements = range(1, len(video_place.visited(scene)) + 1)
    return goals_by_color(scene, "cube", "placement", placements)


def stages(scene: Scene, goal: Goal) -> tuple[Stage, ...]:
    """Return the stages: pick the cube, and place it on the n-th disc that was visited.

    Which one that is follows from the video: ``placement=2`` is the second disc in its order.
    """
    answer = video_place.visited(scene)[goal.number("placement") - 1]
    return video_place.place_stages(scene, goal.text("color"), answer)


TASK = Task(
    name="VideoPlaceOrder",
    suite="reference",
    code=11,
    spatial=False,
    sample=sample,
    goals=goals,
    stages=stages,
    demonstration=video_place.demonstration,
    words="VideoPlaceOrder.toml",
)
