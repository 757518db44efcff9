"""The world is RoboMME's (sizes, masses, rest positions, motions) and repeats itself."""

import numpy as np
import pytest
from moved_worlds import rest

from roboirg.core import waiting
from roboirg.core.conditions import Fact
from roboirg.core.errors import InvalidValueError
from roboirg.simulation import physics_settings
from roboirg.simulation.world import World
from roboirg.tasks import every_task
from roboirg.tasks.splits.splits import get_episode

pytestmark = pytest.mark.sim

TASKS = tuple(every_task())


def world_of(task, index=3, *, visible=False):
    episode = get_episode(task, "test", index)
    return World(episode.scene, visible=visible)


def test_physics_and_drawing_report_when_they_begin_and_end(monkeypatch):
    """A driver may hang in native code, so a listener is called when it begins, with the time, and
    when it ends, with 0; here the only listener is a function that notes it. A control step is
    physics. A picture is begun in the background, and then fetched: two calls of drawing."""
    world = world_of("PickXtimes", visible=True)
    reported = []

    def note(code, since):
        reported.append(f"{code} begins" if since > 0.0 else f"{code} ends")

    monkeypatch.setattr(waiting, "_native_listeners", [note])
    rest(world, 1).picture("front")

    drawing = ["drawing begins", "drawing ends"]
    assert reported == ["physics begins", "physics ends", *drawing, *drawing]


@pytest.mark.parametrize(
    ("task", "name", "kilograms"),
    [
        ("PickXtimes", "cube_red", 0.064),
        ("PickXtimes", "button", 0.0427),
        ("VideoUnmask", "container_0", 0.1311),
    ],
)
def test_cubes_buttons_and_containers_weigh_what_robomme_s_do(task, name, kilograms):
    """The masses were read from RoboMME's simulation, in kilograms; 0.1 g is the tolerance."""
    body = world_of(task).bodies[name]

    assert body.physics.mass == pytest.approx(kilograms, abs=1e-4)


def test_cubes_and_buttons_rest_where_robomme_s_do():
    """A cube's center is 20 mm above the table, and a button is pressed by its weight by 0.5 mm."""
    world = rest(world_of("PickXtimes"), 40)

    assert world.bodies["cube_red"].position.z == pytest.approx(0.02, abs=1e-5)
    assert world.bodies["button"].pressed_depth == pytest.approx(0.0005, abs=5e-5)


def test_in_a_world_at_rest_the_robot_is_still_and_at_home_and_cubes_lie():
    world = rest(world_of("PickXtimes"), 40)

    assert world.facts == {
        Fact("still", "robot"),
        Fact("home", "robot"),
        Fact("lying", "cube_red"),
        Fact("lying", "cube_green"),
        Fact("lying", "cube_blue"),
    }


def test_containers_are_parked_high_up_for_32_steps_and_do_not_count_as_lifted():
    """In VideoUnmask the containers come down over the cubes after 32 steps; until then they are
    more than 5 m high. The only facts are that the robot is still and at home."""
    world = rest(world_of("VideoUnmask"), 32)

    for name in ("container_0", "container_1", "container_2"):
        assert world.bodies[name].position.z > 5, name
    assert world.facts == {Fact("still", "robot"), Fact("home", "robot")}


def test_containers_come_down_after_32_steps_and_rest_at_their_places():
    """In VideoUnmask three containers come down over cubes at step 33, so at step 65 they are at
    rest. As in RoboMME, the center of an empty one is then 52.0 mm above the table; over a cube it
    is 1.3 mm higher, as the container stands on it."""
    scene = get_episode("VideoUnmask", "test", 3).scene

    world = rest(World(scene, visible=False), 65)

    for item in scene.of_kind("container"):
        height_m = 0.0520 if scene.hidden_in(item.name) is None else 0.0533
        position = world.bodies[item.name].position
        assert position[:2] == pytest.approx(item.position[:2], abs=1e-3)
        assert position.z == pytest.approx(height_m, abs=1e-4)


def test_a_container_that_has_appeared_falls_when_it_is_let_go():
    """Its motion keeps it parked for 32 steps, and must leave it to physics afterward."""
    world = rest(world_of("VideoUnmask"), 40)
    container = world.bodies["container_0"]
    container.put(container.position._replace(z=0.3))

    rest(world, 2)

    assert container.position.z < 0.3


def states_of(task, actions):
    """Return the state after each action: joints, facts, and the poses of all bodies."""
    world = world_of(task)
    states = []
    for action in actions:
        facts = world.step(action)
        joints = world.robot.articulation.get_qpos().tobytes()
        poses = []
        for body in world.bodies.values():
            poses.append((body.entity.pose.p.tobytes(), body.entity.pose.q.tobytes()))
        states.append((joints, facts, poses))
    return states


@pytest.mark.parametrize("task", TASKS)
def test_a_world_repeats_itself_bit_for_bit_even_next_to_another_one(task):
    """The same 40 actions, with noise on every joint, are played in two worlds of an episode: all
    joints, facts and poses of bodies must be the same bits. While the second is played, a world of
    another scene, which has moved, lives in this process, and must have no influence."""
    noise = np.random.default_rng(0).normal(0, 0.2, (40, 8))
    noise[:, -1] = 0  # the gripper stays open
    actions = physics_settings.HOME_ACTION + noise

    alone = states_of(task, actions)
    neighbor = rest(world_of("PickXtimes", index=1), 7)
    next_to_it = states_of(task, actions)

    assert next_to_it == alone
    assert neighbor.elapsed == 7  # it was alive until here


def test_the_gripper_closes_and_opens():
    """Each finger is 0.04 m from the middle when the gripper is open."""
    world = world_of("PickXtimes")
    for _ in range(10):
        world.step(np.append(physics_settings.HOME, -1.0))
    closed = world.robot.finger_positions.copy()

    rest(world, 10)

    assert closed == pytest.approx([0, 0], abs=1e-3)
    assert world.robot.finger_positions == pytest.approx([0.04, 0.04], abs=1e-3)


def test_a_robot_with_a_closed_gripper_is_not_at_home():
    """The arm stays in its resting position, and the gripper closes for ten steps (-1); at home it
    is open."""
    world = world_of("PickXtimes")

    for _ in range(10):
        facts = world.step(np.append(physics_settings.HOME, -1.0))

    assert Fact("home", "robot") not in facts


def test_the_robot_is_not_still_while_its_arm_moves():
    """The base joint turns by 0.3 rad, which takes less than 40 steps."""
    world = world_of("PickXtimes")
    action = physics_settings.HOME_ACTION.copy()
    action[0] += 0.3

    facts = [world.step(action) for _ in range(41)]

    assert Fact("still", "robot") not in facts[0]
    assert Fact("still", "robot") in facts[-1]


@pytest.mark.parametrize(
    ("visible", "camera", "sentence"),
    [(False, "front", "without pictures"), (True, "side", "no camera 'side'")],
)
def test_a_world_without_rendering_or_an_unknown_camera_gives_no_picture(visible, camera, sentence):
    world = world_of("PickXtimes", visible=visible)

    with pytest.raises(InvalidValueError, match=sentence):
        world.picture(camera)
