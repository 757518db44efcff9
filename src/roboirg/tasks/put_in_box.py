"""PutInBox: put the yellow tape into the green or the purple box.

Simulated twin of a real-robot task. The instruction selects the box; there is only one tape. Facts:
the paper's study with a real robot. Like an operator, the judge counts a tape in the wrong box as a
failure. Difficulties do not differ.
"""

from __future__ import annotations

import numpy as np

from roboirg.core.conditions import Fact, Rule
from roboirg.core.episode import Color, Difficulty, Goal, Primitive, Scene, Stage
from roboirg.core.footprints import Footprint, Region
from roboirg.tasks.shared.fixtures import footprint
from roboirg.tasks.shared.real_table import (
    draw_box,
    draw_sides,
    draw_tape,
    on_side,
)
from roboirg.tasks.shared.stages import pick_stage
from roboirg.tasks.task import Commands, SceneAndGoal, Task, command_pools
from roboirg.util.random_draws import draw

BOXES: tuple[Color, ...] = ("green", "purple")
TAPE: Color = "yellow"

LEFT_BOX_REGION = Region(0.03, 0.15, 0.05, 0.05)
TAPE_REGION = Region(-0.13, 0.0, 0.08, 0.18)
TAPE_GAP = 0.03


def sample(rng: np.random.Generator, difficulty: Difficulty) -> SceneAndGoal:
    """Draw a box on either side, the tape in front of them; sides and goal box are uniform."""
    del difficulty
    sides = draw_sides(rng, BOXES)
    boxes = tuple(
        draw_box(rng, f"box_{color}", color, on_side(LEFT_BOX_REGION, sides[color]))
        for color in BOXES
    )
    obstacles: list[Footprint] = [footprint(box) for box in boxes]
    tape = draw_tape(rng, "tape", TAPE, TAPE_REGION, TAPE_GAP, obstacles)
    goal = Goal.of(color=str(draw(rng, BOXES)))
    return Scene((*boxes, tape)), goal


def goals(scene: Scene) -> tuple[Goal, ...]:
    """Return a goal for every box of the scene."""
    return tuple(Goal.of(color=str(box.color)) for box in scene.of_kind("box"))


def stages(scene: Scene, goal: Goal) -> tuple[Stage, ...]:
    """Return the stages: pick the tape, and put it into the right box only."""
    target = f"box_{goal.text('color')}"
    wrong = tuple(
        Rule(
            Fact("binned", "tape", box.name),
            f"put the tape into the {box.color} box",
            failure="wrong_place",
        )
        for box in scene.of_kind("box")
        if box.name != target
    )
    pick = pick_stage("tape", "pick up the tape {at}", wrong)
    put_in = Stage(
        expects=Fact("binned", "tape", target),
        forbids=wrong,
        primitive=Primitive("put_into", "tape", target),
        subgoal=f"put the tape into the {goal.text('color')} box {{at}}",
        points_at=target,
    )
    return pick, put_in


COMMANDS = Commands(
    thing="box",
    colored="box",
    # Excluding the colors of the tape and one box leaves the other box.
    colors=(*BOXES, TAPE),
    by_place="the box {place}",
    pointed="box",
    things_at="the box {place}",
    wordings=command_pools(
        train=(
            "Put the tape into {color}.",
            "Please place the tape into {color}.",
            "Drop the tape into {color}.",
        ),
        test=(
            "Lay the tape in {color}.",
            "Move the tape into {color}.",
            "Please set the tape into {color}.",
        ),
    ),
)

TASK = Task(
    name="PutInBox",
    suite="real",
    code=12,
    spatial=True,
    sample=sample,
    goals=goals,
    stages=stages,
    commands=COMMANDS,
)
