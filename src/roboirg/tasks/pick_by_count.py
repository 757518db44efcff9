"""PickByCount: pick the yellow or the gray tape and place it on the target, once or twice.

Simulated twin of a real-robot task. Nothing marks the end: like an operator, the judge waits
whether the robot continues. Facts: the paper's study with a real robot. Difficulties do not differ.
"""

from __future__ import annotations

from functools import partial

import numpy as np

from roboirg.core.conditions import Elapsed, Fact, Rule
from roboirg.core.episode import Color, Difficulty, Goal, Primitive, Scene, Stage
from roboirg.core.footprints import Circle, Footprint, Region
from roboirg.tasks.shared.fixtures import counted_goals, draw_number, draw_target
from roboirg.tasks.shared.real_table import draw_sides, draw_tape, on_side
from roboirg.tasks.shared.stages import placing_stages
from roboirg.tasks.task import Commands, SceneAndGoal, Task, command_pools
from roboirg.util.random_draws import draw

TAPES: tuple[Color, ...] = ("yellow", "gray")
REPEATS = (1, 2)

TARGET_REGION = Region(0.06, 0.0, 0.1, 0.1)
TARGET_RADIUS = 0.05
LEFT_TAPE_REGION = Region(-0.09, 0.14, 0.11, 0.09)
TAPE_GAP = 0.03
WAIT_STEPS = 140
"""Control steps without a pick that end the task: a policy that continues has picked a tape by
then. The longest pick in RoboMME's data takes 137."""


def sample(rng: np.random.Generator, difficulty: Difficulty) -> SceneAndGoal:
    """Draw the target and a tape on either side; sides, goal tape and number are uniform."""
    del difficulty
    target = draw_target(rng, "target", TARGET_RADIUS, TARGET_REGION, 0.0, ())
    obstacles: list[Footprint] = [Circle(target.position.x, target.position.y, TARGET_RADIUS)]
    sides = draw_sides(rng, TAPES)
    tapes = tuple(
        draw_tape(
            rng,
            f"tape_{color}",
            color,
            on_side(LEFT_TAPE_REGION, sides[color]),
            TAPE_GAP,
            obstacles,
        )
        for color in TAPES
    )
    chosen = draw(rng, TAPES)
    goal = Goal.of(color=str(chosen), repeats=draw_number(rng, REPEATS))
    return Scene((*tapes, target)), goal


def stages(scene: Scene, goal: Goal) -> tuple[Stage, ...]:
    """Return the stages: N times pick and place, then leave all tapes alone for a while."""
    color = goal.text("color")
    tape = f"tape_{color}"
    wrong = tuple(
        Rule(Fact("picked", item.name), f"picked up the {item.color} tape", failure="wrong_object")
        for item in scene.of_kind("tape")
        if item.name != tape
    )
    again = Rule(Fact("picked", tape), f"picked up the {color} tape again", failure="wrong_count")
    plan = placing_stages("tape", color, goal.number("repeats"), wrong)
    leave = Stage(
        expects=Elapsed(WAIT_STEPS, timer="left alone"),
        forbids=(again, *wrong),
        primitive=Primitive("retreat", "robot", steps=WAIT_STEPS),
        subgoal="leave the tapes where they are",
        timer="left alone",
    )
    return (*plan, leave)


COMMANDS = Commands(
    thing="tape",
    colored="tape",
    colors=TAPES,
    by_place="the tape {place}",
    pointed="tape",
    things_at="the tape {place}",
    wordings=command_pools(
        train=(
            "Take {color} and place it on the target {repeats}.",
            "Put {color} on the target {repeats}.",
            "Please place {color} on the target {repeats}.",
        ),
        test=(
            "Grab {color} and set it on the target {repeats}.",
            "Lay {color} on the target {repeats}.",
            "Please set {color} on the target {repeats}.",
        ),
    ),
)

TASK = Task(
    name="PickByCount",
    suite="real",
    code=13,
    spatial=True,
    sample=sample,
    goals=partial(counted_goals, kind="tape", most=REPEATS[1]),
    stages=stages,
    commands=COMMANDS,
)
