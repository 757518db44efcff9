"""VideoPlaceButton: place the cube on the disc where it was right before or after the press.

Reference suite. The video shows a cube placed on a disc, the button pressed, the cube placed on
another disc and put back; in hard episodes two discs change places at its end. Facts: RoboMME.
"""

from __future__ import annotations

import numpy as np

from roboirg.core.conditions import Fact
from roboirg.core.episode import Difficulty, Goal, Scene, Stage
from roboirg.tasks.shared import video_place
from roboirg.tasks.shared.stages import PRESSED
from roboirg.tasks.task import Commands, SceneAndGoal, Task, command_pools
from roboirg.util.random_draws import draw

DISCS: dict[Difficulty, int] = {"easy": 3, "medium": 4, "hard": 4}
SITE_RADIUS = 0.06
RELATIONS = ("before", "after")


def sample(rng: np.random.Generator, difficulty: Difficulty) -> SceneAndGoal:
    """Draw a scene in which the cube goes to ``target_0``, then to ``target_1`` after the press."""
    cubes = video_place.CUBES[difficulty]
    table, cube = video_place.draw_table(rng, cubes, DISCS[difficulty], SITE_RADIUS)
    discs = table.of_kind("target")
    before, after = (Fact("placed", cube.name, disc.name) for disc in discs[:2])
    past = (before, PRESSED, after)
    swaps = (video_place.draw_swap(rng, discs, past),) if difficulty == "hard" else ()
    relation = draw(rng, RELATIONS)
    return Scene(table.objects, swaps, past), Goal.of(color=str(cube.color), relation=relation)


def goals(scene: Scene) -> tuple[Goal, ...]:
    """Return a goal for every cube and the disc used before or after the press."""
    return tuple(
        Goal.of(color=color, relation=relation)
        for color in video_place.colors_of(scene)
        for relation in RELATIONS
    )


def stages(scene: Scene, goal: Goal) -> tuple[Stage, ...]:
    """Return the stages: pick the cube, and place it on the disc before or after the press."""
    step = -1 if goal.text("relation") == "before" else 1
    placing = scene.past[scene.past.index(PRESSED) + step]
    return video_place.place_stages(scene, goal.text("color"), str(placing.place))


COMMANDS = Commands(
    wordings=command_pools(
        train=(
            "Think back to the video and put {color} on {relation}.",
            "You saw the video, so put {color} on {relation}.",
            "Going by the video, place {color} on {relation}.",
        ),
        test=(
            "Going by what you saw, set {color} on {relation}.",
            "Keep the video in mind and place {color} on {relation}.",
            "You watched the video, so set {color} on {relation}.",
        ),
    ),
)

TASK = Task(
    name="VideoPlaceButton",
    suite="reference",
    code=10,
    spatial=False,
    sample=sample,
    goals=goals,
    stages=stages,
    commands=COMMANDS,
    demonstration=video_place.demonstration,
)
