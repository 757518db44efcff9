"""Stages of several tasks and of their videos: what is expected, and how the oracle does it.

They forbid nothing; a task adds what fails its episodes with `Stage.forbidding`.
"""

from __future__ import annotations

from collections.abc import Iterable

from roboirg.core.conditions import Condition, Fact
from roboirg.core.episode import Primitive, SceneObject, Stage
from roboirg.core.fact_traits import FactKind
from roboirg.tasks.shared.fixtures import ORDINALS

PRESSED = Fact("pressed", "button")
RETREAT_STEPS = 20
"""Control steps for which the hand waits away from the objects (RoboMME)."""


def facts_of_all(kind: FactKind, objects: Iterable[SceneObject]) -> tuple[Fact, ...]:
    """Return the facts of a kind about some objects: that a red cube is picked, and a green one."""
    return tuple(Fact(kind, item.name) for item in objects)


def facts_of_others(kind: FactKind, objects: Iterable[SceneObject], right: str) -> tuple[Fact, ...]:
    """Return the facts of a kind about all objects but the right one, as a stage forbids them.

    With ``"picked"``, all cubes and ``"cube_red"``: that a green cube is picked, and a blue one.
    """
    return tuple(Fact(kind, item.name) for item in objects if item.name != right)


def pick_stage(
    name: str, subgoal: str = "pick up the cube {at}", timer: str | None = None
) -> Stage:
    """Return the stage in which a cube or tape, given its name, is picked up.

    In `subgoal`, ``{at}`` stands for the object's point in the picture. With `timer`, a clock of
    that name starts with the stage; rules can ask for its time.
    """
    return Stage(
        expects=Fact("picked", name),
        primitive=Primitive("pick_cube", name),
        subgoal=subgoal,
        points_at=name,
        timer=timer,
    )


def place_stage(name: str, place: str, subgoal: str) -> Stage:
    """Return the stage in which a cube or tape `name` is placed on the target `place`."""
    return Stage(
        expects=Fact("placed", name, place),
        primitive=Primitive("place_on", name, place),
        subgoal=subgoal,
        points_at=place,
    )


def put_down_stage(put_down: Primitive, subgoal: str, timer: str | None = None) -> Stage:
    """Return the stage in which a cube is put down on the table; `put_down` is the movement.

    It is complete when the cube lies on the table. With `timer`, a clock of that name starts.
    """
    return Stage(
        expects=Fact("lying", put_down.subject),
        primitive=put_down,
        subgoal=subgoal,
        timer=timer,
    )


def placing_stages(kind: str, color: str, repeats: int) -> list[Stage]:
    """Return the stages in which a cube or tape is placed on the target a number of times.

    ``("cube", "red", 2)`` -> pick up ``cube_red``, place it, pick it up again, place it again.
    """
    name = f"{kind}_{color}"
    plan = []
    for ordinal in ORDINALS[:repeats]:
        pick = f"pick up the {color} {kind} {{at}} for the {ordinal} time"
        put = f"place the {color} {kind} onto the target {{at}}"
        plan.append(pick_stage(name, pick))
        plan.append(place_stage(name, "target", put))
    return plan


def press_stage(
    subgoal: str = "press the button {at}", expects: Condition = PRESSED, button: str = "button"
) -> Stage:
    """Return the stage in which a button is pressed, until `expects` holds.

    By default the scene has one button, and any press of it completes the stage.
    """
    return Stage(
        expects=expects,
        primitive=Primitive("press", button),
        subgoal=subgoal,
        points_at=button,
    )


def retreat() -> Stage:
    """Return the stage in which the hand moves away from the objects and waits there."""
    return _static(Primitive("retreat", "robot", steps=RETREAT_STEPS))


def hold_still(steps: int) -> Stage:
    """Return the stage in which the robot holds still for a number of control steps."""
    return _static(Primitive("hold", "robot", steps=steps))


def _static(primitive: Primitive) -> Stage:
    """Return the stage of a movement that ends at rest and lasts `primitive.steps` steps."""
    return Stage(
        expects=Fact("still", "robot"),
        primitive=primitive,
        subgoal="static",
        lasting=primitive.steps,
    )


def go_home() -> Stage:
    """Return the stage after the video in which the robot goes to the policy's start pose.

    It is played, but no part of the recorded video.
    """
    return Stage(
        expects=Fact("home", "robot"),
        primitive=Primitive("go_home", "robot"),
        subgoal="go home",
        in_video=False,
    )
