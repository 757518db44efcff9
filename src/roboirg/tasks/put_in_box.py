"""PutInBox: put the yellow tape into the green or the purple box.

Simulated twin of a real-robot task. The instruction selects the box; there is only one tape. Facts:
the paper's study with a real robot. Like an operator, the judge counts a tape in the wrong box as a
failure. Difficulties do not differ.
"""

from __future__ import annotations

import numpy as np

from roboirg.core.conditions import Fact, Rule
from roboirg.core.episode import Color, Difficulty, Goal, Primitive, Scene, SceneObject, Stage
from roboirg.core.footprints import Region
from roboirg.tasks.shared.fixtures import ItemPlan, draw_item, footprint
from roboirg.tasks.shared.real_table import draw_box, draw_regions
from roboirg.tasks.shared.stages import pick_stage
from roboirg.tasks.task import GoalThings, SceneAndGoal, Task
from roboirg.util.random_draws import draw

BOXES: tuple[Color, ...] = ("green", "purple")
TAPE: Color = "yellow"

LEFT_BOX_REGION = Region(0.03, 0.15, 0.05, 0.05)
TAPE_PLAN = ItemPlan("tape", TAPE, Region(-0.13, 0.0, 0.08, 0.18), gap=0.03, kind="tape")


def sample(rng: np.random.Generator, _difficulty: Difficulty) -> SceneAndGoal:
    """Draw a box on either side, the tape in front of them; sides and goal box are uniform.

    The order of the draws decides which scene a seed gives.
    """
    boxes = _draw_boxes(rng)
    tape = draw_item(rng, TAPE_PLAN, [footprint(box) for box in boxes])
    return Scene((*boxes, tape)), Goal.of(color=draw(rng, BOXES))


def _draw_boxes(rng: np.random.Generator) -> list[SceneObject]:
    """Draw a box of each color, ``box_green`` and ``box_purple``, one on either side."""
    boxes = []
    for color, region in draw_regions(rng, BOXES, LEFT_BOX_REGION).items():
        boxes.append(draw_box(rng, f"box_{color}", color, region))
    return boxes


def goals(scene: Scene) -> tuple[Goal, ...]:
    """Return a goal for every box of the scene."""
    return tuple(Goal.of(color=str(box.color)) for box in scene.of_kind("box"))


def stages(scene: Scene, goal: Goal) -> tuple[Stage, ...]:
    """Return the stages: pick up the tape, and put it into the box of the goal's color.

    In both, a tape in the other box fails the episode.
    """
    color = goal.text("color")
    wrong = []
    for box in scene.of_kind("box"):
        if box.color != color:
            cause = f"put the tape into the {box.color} box"
            wrong.append(Rule(Fact("binned", "tape", box.name), cause, failure="wrong_place"))
    put_in = Stage(
        expects=Fact("binned", "tape", f"box_{color}"),
        primitive=Primitive("put_into", "tape", f"box_{color}"),
        subgoal=f"put the tape into the {color} box {{at}}",
        points_at=f"box_{color}",
    )
    pick = pick_stage("tape", "pick up the tape {at}")
    return pick.forbidding(*wrong), put_in.forbidding(*wrong)


TASK = Task(
    name="PutInBox",
    suite="real",
    code=12,
    spatial=True,
    sample=sample,
    goals=goals,
    stages=stages,
    # Excluding the colors of the tape and one box leaves the other box.
    things=GoalThings(handled="box", colored="box", pointed="box", colors=(*BOXES, TAPE)),
    words="real_study.toml",
)
