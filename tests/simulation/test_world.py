"""The world is RoboMME's (sizes, masses, rest positions, motions) and repeats itself."""

import numpy as np
import pytest
from moved_worlds import rest

from roboirg.core import waiting
from roboirg.core.conditions import Fact
from roboirg.core.episode import Scene
from roboirg.core.errors import InvalidValueError
from roboirg.core.motions import Away
from roboirg.simulation import physics_settings
from roboirg.simulation.world import World
from roboirg.tasks import every_task
from roboirg.tasks.splits.splits import get_episode

pytestmark = pytest.mark.sim

TASKS = tuple(every_task())


def world_of(task: str, index: int = 3, *, visible: bool = False) -> World:
    episode = get_episode(task, "test", index)
    return World(episode.scene, visible=visible)


def test_physics_and_drawing_report_when_they_begin_and_end(monkeypatch):
    """A driver may hang in them; a listener gets (code, time of begin, or 0 at the end)."""
    calls: list[tuple[str, float]] = []
    world = world_of("PickXtimes", visible=True)
    monkeypatch.setattr(waiting, "_native_listeners", [lambda *call: calls.append(call)])

    rest(world, 1).picture("front")

    # A picture is begun in the background, and then fetched.
    assert [(code, since > 0.0) for code, since in calls] == [
        *[("physics", True), ("physics", False)],
        *[("drawing", True), ("drawing", False)] * 2,
    ]


def test_cubes_and_buttons_rest_where_and_weigh_what_robomme_s_do():
    """Heights in meters, masses in kilograms."""
    world = rest(world_of("PickXtimes"), 40)
    cube = world.bodies["cube_red"]
    button = world.bodies["button"]
    assert cube.position.z == pytest.approx(0.02, abs=1e-5)
    assert cube.physics.mass == pytest.approx(0.064)
    assert button.physics.mass == pytest.approx(0.0427, abs=1e-4)
    assert button.pressed_depth == pytest.approx(0.0005, abs=5e-5)

    cubes = {Fact("lying", f"cube_{color}") for color in ("red", "green", "blue")}
    assert world.facts == {Fact("still", "robot"), Fact("home", "robot"), *cubes}


def test_containers_appear_over_their_cubes_after_32_steps():
    """Until then they are parked 10 m high."""
    world = world_of("VideoUnmask")
    rest(world, 32)
    assert all(
        body.position.z > 5 for body in world.bodies.values() if body.item.kind == "container"
    )
    # Where they are parked is not a lift.
    assert world.facts == {Fact("still", "robot"), Fact("home", "robot")}

    rest(world, 33)
    for body in world.bodies.values():
        if body.item.kind == "container":
            assert body.position[:2] == pytest.approx(body.item.position[:2], abs=1e-3)
            # Over a cube a container rests on it, 1.3 mm high.
            empty = world_scene(world).hidden_in(body.item.name) is None
            assert body.position.z == pytest.approx(0.0520 if empty else 0.0533, abs=1e-4)
            assert body.physics.mass == pytest.approx(0.1311, abs=1e-4)


def world_scene(world: World) -> Scene:
    return Scene(tuple(body.item for body in world.bodies.values()))


def test_a_container_that_has_appeared_falls_when_it_is_let_go():
    """`Away` keeps it parked at first, and must leave it to physics afterward."""
    episode = get_episode("VideoUnmask", "test", 0)
    moved = World(episode.scene, visible=False)
    rest(moved, 40)
    assert all(isinstance(motion, Away) for motion in episode.scene.motions)

    body = moved.bodies["container_0"]
    body.put(body.item.position._replace(z=0.3))
    rest(moved, 2)
    assert body.position.z < 0.3


@pytest.mark.parametrize("task", TASKS)
def test_a_world_repeats_itself_bit_for_bit_even_next_to_another_one(task):
    rng = np.random.default_rng(0)
    actions = physics_settings.HOME_ACTION + np.append(
        rng.normal(0, 0.2, (40, 7)), np.zeros((40, 1)), 1
    )

    def trace():
        world = world_of(task)
        states = []
        for action in actions:
            facts = world.step(action)
            poses = [body.entity.pose for body in world.bodies.values()]
            qpos = world.robot.articulation.get_qpos()
            states.append((qpos.tobytes(), facts, *((p.p.tobytes(), p.q.tobytes()) for p in poses)))
        return states

    first = trace()
    other = world_of(TASKS[0], index=1)  # another world alive and moving makes no difference

    rest(other, 7)

    assert trace() == first


def test_the_gripper_opens_and_closes():
    world = world_of("PickXtimes")
    closing = np.append(physics_settings.HOME, -1.0)
    for _ in range(10):
        world.step(closing)
    assert world.robot.finger_positions == pytest.approx([0, 0], abs=1e-3)
    assert Fact("home", "robot") not in world.facts

    rest(world, 10)
    assert world.robot.finger_positions == pytest.approx([0.04, 0.04], abs=1e-3)


def test_the_robot_is_not_still_while_its_arm_moves():
    """The base joint turns by 0.3 rad, which takes less than 40 steps."""
    world = world_of("PickXtimes")
    action = physics_settings.HOME_ACTION.copy()
    action[0] += 0.3
    world.step(action)

    assert Fact("still", "robot") not in world.facts

    for _ in range(40):
        world.step(action)
    assert Fact("still", "robot") in world.facts


def test_a_world_without_rendering_or_an_unknown_camera_gives_no_picture():
    with pytest.raises(InvalidValueError, match="without pictures"):
        world_of("PickXtimes").picture("front")
    with pytest.raises(InvalidValueError, match="no camera 'side'"):
        world_of("PickXtimes", visible=True).picture("side")
