"""VideoPlaceButton: place the cube on the disc where it was right before or after the press.

Reference suite. The video shows a cube placed on a disc, the button pressed, the cube placed on
another disc and put back; in hard episodes two discs change places at its end. Facts: RoboMME.
"""

from __future__ import annotations

import numpy as np

from roboirg.core.conditions import Fact
from roboirg.core.episode import Difficulty, Goal, Scene, Stage
from roboirg.core.goal_slots import MOMENTS
from roboirg.tasks.shared import video_place
from roboirg.tasks.shared.fixtures import goals_by_color
from roboirg.tasks.shared.stages import PRESSED
from roboirg.tasks.task import SceneAndGoal, Task
from roboirg.util.random_draws import draw

DISCS: dict[Difficulty, int] = {"easy": 3, "medium": 4, "hard": 4}
SITE_RADIUS = 0.06


def sample(rng: np.random.Generator, difficulty: Difficulty) -> SceneAndGoal:
    """Draw a scene in which the cube goes to ``target_0``, then to ``target_1`` after the press.

    The goal is the cube of the video, on the disc before or after the press.
    """
    table = video_place.draw_table(rng, difficulty, DISCS[difficulty], SITE_RADIUS)
    cube = table.cube
    before = Fact("placed", cube.name, "target_0")
    after = Fact("placed", cube.name, "target_1")
    past = (before, PRESSED, after)
    scene = video_place.draw_scene(rng, difficulty, table, past)
    goal = Goal.of(color=str(cube.color), relation=draw(rng, MOMENTS))
    return scene, goal


def goals(scene: Scene) -> tuple[Goal, ...]:
    """Return two goals for every cube: the disc used before the press, and that used after it."""
    return goals_by_color(scene, "cube", "relation", MOMENTS)


def stages(scene: Scene, goal: Goal) -> tuple[Stage, ...]:
    """Return the stages: pick the cube, and place it on the disc before or after the press."""
    press = scene.past.index(PRESSED)
    is_before = goal.text("relation") == "before"
    placing = scene.past[press - 1 if is_before else press + 1]
    return video_place.place_stages(scene, goal.text("color"), str(placing.place))


TASK = Task(
    name="VideoPlaceButton",
    suite="reference",
    code=10,
    spatial=False,
    sample=sample,
    goals=goals,
    stages=stages,
    demonstration=video_place.demonstration,
    words="VideoPlaceButton.toml",
)
