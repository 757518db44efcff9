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
from roboirg.tasks.shared.fixtures import draw_number
from roboirg.tasks.shared.stages import PRESSED
from roboirg.tasks.task import Commands, SceneAndGoal, Task, command_pools

DISCS = 4
PLACEMENTS = (2, 4)
"""Fewest and most discs that the cube visits."""
SITE_RADIUS = 0.1


def sample(rng: np.random.Generator, difficulty: Difficulty) -> SceneAndGoal:
    """Draw the visited discs, their order, the goal's disc and the time of the press."""
    cubes = video_place.CUBES[difficulty]
    table, cube = video_place.draw_table(rng, cubes, DISCS, SITE_RADIUS)
    discs = table.of_kind("target")
    placements = draw_number(rng, PLACEMENTS)
    order = rng.permutation(DISCS)[:placements]
    shown = [Fact("placed", cube.name, discs[index].name) for index in order]
    placement = int(rng.integers(1, placements + 1))
    pressed_after = int(rng.integers(1, placements + 1))
    past = (*shown[:pressed_after], PRESSED, *shown[pressed_after:])
    swaps = (video_place.draw_swap(rng, discs, past),) if difficulty == "hard" else ()
    return Scene(table.objects, swaps, past), Goal.of(color=str(cube.color), placement=placement)


def goals(scene: Scene) -> tuple[Goal, ...]:
    """Return a goal for every cube and every disc that was visited."""
    return tuple(
        Goal.of(color=color, placement=placement)
        for color in video_place.colors_of(scene)
        for placement in range(1, len(video_place.visited(scene)) + 1)
    )


def stages(scene: Scene, goal: Goal) -> tuple[Stage, ...]:
    """Return the stages: pick the cube, and place it on the n-th disc that was visited."""
    answer = video_place.visited(scene)[goal.number("placement") - 1]
    return video_place.place_stages(scene, goal.text("color"), answer)


COMMANDS = Commands(
    wordings=command_pools(
        train=(
            "Think back to the video and put {color} on {placement}.",
            "You saw the video, so put {color} on {placement}.",
            "Going by the video, place {color} on {placement}.",
        ),
        test=(
            "Going by what you saw, set {color} on {placement}.",
            "Keep the video in mind and place {color} on {placement}.",
            "You watched the video, so set {color} on {placement}.",
        ),
    ),
)

TASK = Task(
    name="VideoPlaceOrder",
    suite="reference",
    code=11,
    spatial=False,
    sample=sample,
    goals=goals,
    stages=stages,
    commands=COMMANDS,
    demonstration=video_place.demonstration,
)
