"""VideoRepick: pick up the cube from the video N times, then press the button.

Reference suite. The video shows one of several cubes picked up and put down. In easy and medium
episodes all cubes look alike and change places afterwards; in hard ones none of many cubes moves.
Facts: RoboMME.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from roboirg.core.conditions import All, Elapsed, Fact, Rule
from roboirg.core.episode import COLORS, Difficulty, Goal, Primitive, Scene, SceneObject, Stage
from roboirg.core.footprints import Region
from roboirg.core.motions import Swap
from roboirg.tasks.shared.fixtures import (
    ORDINALS,
    Bounds,
    ItemPlan,
    button_keep_out,
    draw_button,
    draw_cubes,
    draw_number,
)
from roboirg.tasks.shared.layouts import layout_points
from roboirg.tasks.shared.stages import (
    PRESSED,
    facts_of_all,
    facts_of_others,
    go_home,
    hold_still,
    pick_stage,
    press_stage,
    put_down_stage,
    retreat,
)
from roboirg.tasks.shared.swapping import SWAP_START, SWAP_STEPS, plan_swaps
from roboirg.tasks.task import SceneAndGoal, Task
from roboirg.util.random_draws import draw, shuffled

REPEATS = (1, 3)
SWAPS: dict[Difficulty, Bounds] = {"easy": (1, 2), "medium": (2, 3), "hard": (0, 0)}

BUTTON_REGION = Region(-0.2, 0.0, 0.05, 0.05)
GAP = 0.02
LAYOUT_CUBES = 3
LAYOUT_HALF = 0.07
"""Half side of the square around a layout point in which its cube lies, m."""
CLUTTER_REGION = Region(-0.1, 0.0, 0.2, 0.25)
CLUTTER_ROUNDS = 5
"""Cubes of each color on a cluttered table."""

SWAP_LANE = 0.07
SWAP_STAGE = 3
"""Index of the demonstration's stage with which the swaps start: the first hold."""

SHOWN_RELEASE = 0.03
"""Tool height at which the oracle releases the cube in the video, m."""
OWN_RELEASE = 0.01
"""The same in the policy's turn."""

EARLY_PRESS = (50, 500)
"""A premature press fails only within these control steps of its timer."""


def sample(rng: np.random.Generator, difficulty: Difficulty) -> SceneAndGoal:
    """Draw button and cubes; the cube of the video and the number of repeats are uniform.

    In hard episodes many cubes of all colors lie about, and none moves; in the others, three of one
    color change places. The order of the draws decides which scene a seed gives.
    """
    repeats = draw_number(rng, REPEATS)
    swaps = draw_number(rng, SWAPS[difficulty])
    button = draw_button(rng, BUTTON_REGION)
    cubes = _draw_cubes(rng, difficulty, button)
    # The cube of the video starts the first swap, the others follow in any order.
    order = [cube.name for cube in shuffled(rng, cubes)]
    scene = make_scene(button, cubes, order[0], order[:swaps])
    return scene, Goal.of(repeats=repeats)


def make_scene(
    button: SceneObject,
    cubes: Sequence[SceneObject],
    target: str,
    initiators: Sequence[str],
    partners: Sequence[str | None] = (),
) -> Scene:
    """Return the scene whose video shows the cube `target` picked up and put down, and then swaps.

    `initiators` are the names of the cubes that start a swap, in order; each changes places with
    the nearest cube, or with its partner where that is known. `partners[i]` belongs to
    `initiators[i]`; None, and those that are missing at the end, are unknown.
    """
    motions = plan_swaps(
        cubes,
        initiators,
        start=SWAP_START,
        lane=SWAP_LANE,
        stage=SWAP_STAGE,
        partners=partners,
    )
    return Scene(
        objects=(button, *cubes),
        motions=motions,
        past=(Fact("picked", target), Fact("lying", target)),
    )


def _draw_cubes(
    rng: np.random.Generator, difficulty: Difficulty, button: SceneObject
) -> list[SceneObject]:
    """Draw many cubes of all colors for hard episodes, and three of one color for the others."""
    if difficulty == "hard":
        plans = _clutter_plans(rng)
    else:
        plans = _layout_plans(rng)
    return draw_cubes(rng, plans, [button_keep_out(button)])


def _layout_plans(rng: np.random.Generator) -> Iterator[ItemPlan]:
    """Yield three cubes of one color to be drawn, each near its point of a layout.

    They are called ``cube_red_0`` to ``cube_red_2``.
    """
    color = draw(rng, COLORS)
    for number, point in enumerate(layout_points(rng, LAYOUT_CUBES)):
        region = Region(*point, half_x=LAYOUT_HALF, half_y=LAYOUT_HALF)
        yield ItemPlan(f"cube_{color}_{number}", color, region, GAP)


def _clutter_plans(rng: np.random.Generator) -> Iterator[ItemPlan]:
    """Yield five cubes of each color to be drawn: in each round one of each, in any order.

    The colors of a round are drawn after the cubes of the one before.
    """
    for number in range(CLUTTER_ROUNDS):
        for color in shuffled(rng, COLORS):
            yield ItemPlan(f"cube_{color}_{number}", color, CLUTTER_REGION, GAP)


def demonstration(scene: Scene) -> tuple[Stage, ...]:
    """Return the video's stages: pick up the cube, put it down, wait while cubes change places.

    `SWAP_STAGE` counts on this order: with swaps, stage 3 is the first in which the hand holds
    still.
    """
    target = scene.past[0].subject
    release = Primitive("put_down", target, height=SHOWN_RELEASE)
    put_down = put_down_stage(release, "drop the cube on the table")
    plan = [pick_stage(target), put_down]
    swaps = scene.motions_of(Swap)
    if swaps:
        plan.append(retreat())
    plan += [hold_still(SWAP_STEPS)] * len(swaps)
    return (*plan, go_home())


def goals(_scene: Scene) -> tuple[Goal, ...]:
    """Return a goal for each of one to three repeats; the video shows the cube."""
    low, high = REPEATS
    return tuple(Goal.of(repeats=repeats) for repeats in range(low, high + 1))


def stages(scene: Scene, goal: Goal) -> tuple[Stage, ...]:
    """Return 2 N + 1 stages: N times pick up and put down, then press.

    What a stage forbids fails the episode: picking another cube, an early press; in the last stage
    any pick. A timer starts with the first stage that names it, so those of a premature press do
    not start again with each repeat.
    """
    target = scene.past[0].subject  # the cube that the video shows picked up
    cubes = scene.of_kind("cube")
    wrong_picks = facts_of_others("picked", cubes, target)
    plan = []
    for stage in _picks(target, goal.number("repeats")):
        plan.append(stage.forbidding(*wrong_picks, _early_press(stage.timer)))
    press = press_stage("press the button {at} to finish")
    plan.append(press.forbidding(*facts_of_all("picked", cubes)))
    return tuple(plan)


def _picks(target: str, repeats: int) -> Iterator[Stage]:
    """Yield the stages in which the cube `target` is picked up and put down a number of times.

    Both kinds of stages start a timer, ``pick`` and ``put down``; they forbid nothing yet.
    """
    release = Primitive("put_down", target, height=OWN_RELEASE)
    for ordinal in ORDINALS[:repeats]:
        subgoal = f"pick up the correct cube {{at}} for the {ordinal} time"
        yield pick_stage(target, subgoal, timer="pick")
        yield put_down_stage(release, "put it down", timer="put down")


def _early_press(timer: str | None) -> Rule:
    """Return the rule against a premature press, given the name of its timer.

    A press fails only from step 50 to step 500 of that timer, as in RoboMME.
    """
    is_early = Elapsed(*EARLY_PRESS, timer=timer)
    return Rule(All((PRESSED, is_early)), "pressed the button too early")


TASK = Task(
    name="VideoRepick",
    suite="reference",
    code=9,
    spatial=False,
    sample=sample,
    goals=goals,
    stages=stages,
    demonstration=demonstration,
    words="VideoRepick.toml",
)
