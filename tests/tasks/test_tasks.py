"""Invariants of every task, over the whole registry and every split."""

import functools
import itertools

import numpy as np
import pytest
from drawn_scenes import drawn_episodes

from roboirg.core import object_sizes
from roboirg.core.episode import DIFFICULTIES, ROBOT_BASE, SPLITS
from roboirg.core.footprints import Circle, overlap
from roboirg.core.motions import Away, Glow, Shuttle, Swap, Vanish
from roboirg.language.settings import plain_settings
from roboirg.tasks import every_task, get_task
from roboirg.tasks.other_goals import other_goals
from roboirg.tasks.shared.fixtures import footprint
from roboirg.tasks.splits.splits import get_episode, make_episode, split_episodes

TASKS = tuple(every_task())
HEIGHTS = {
    "cube": (0.02,),
    "hidden_cube": (0.02 / 1.2,),
    "container": (0.052,),
    "target": (0.005, 0.01),
    "button": (0.0075,),
    "bin": (0.025,),
    "site": (0.005,),
    "shuttle": (0.01,),
    "marker": (-0.005,),
    "box": (0.02,),
    "tape": (0.0175,),
}
"""Of the origin of a thing that lies on the table, meters."""

REGISTERED = [
    (1, "PickXtimes", "counting", True),
    (2, "StopCube", "counting", False),
    (3, "SwingXtimes", "counting", True),
    (4, "BinFill", "counting", True),
    (5, "VideoUnmaskSwap", "permanence", True),
    (6, "VideoUnmask", "permanence", True),
    (7, "ButtonUnmaskSwap", "permanence", True),
    (8, "ButtonUnmask", "permanence", True),
    (9, "VideoRepick", "reference", False),
    (10, "VideoPlaceButton", "reference", False),
    (11, "VideoPlaceOrder", "reference", False),
    (12, "PutInBox", "real", True),
    (13, "PickByCount", "real", True),
]
"""Code, name, suite, and whether words for sides name its objects."""

REACH = 0.85
"""How far from its base the robot is asked to handle anything, meters in the plane. Its own is
0.855; the farthest corner of all regions in which things are placed is 0.815 away."""

# Front camera, RoboMME: world to camera, OpenCV convention, and 90 degrees over 256 pixels.
FRONT_CAMERA = np.array(
    [[0, 1, 0, 0], [0.89443, 0, -0.44721, -0.08944], [-0.44721, 0, -0.89443, 0.49194]]
)
FOCAL = CENTER = 128

each_task = pytest.mark.parametrize("task", TASKS)


@functools.cache
def episodes(task):
    """All episodes of the splits."""
    return tuple(split_episodes([task], SPLITS))


@functools.cache
def first_episodes(task, difficulty, count=1):
    """The episodes of the first seeds that give a scene."""
    return tuple(itertools.islice(drawn_episodes(task, difficulty), count))


def test_the_registry_holds_each_task_once_in_the_order_of_its_code():
    """Also: only tasks with words for sides have the setting *spatial*."""
    registered = [
        (task.code, task.name, task.suite, task.spatial) for task in every_task().values()
    ]
    assert registered == REGISTERED
    assert tuple(every_task()) == tuple(name for _, name, *_ in registered)
    for name, task in every_task().items():
        sides = ("spatial",) if task.spatial else ()
        assert plain_settings(task)[:4] == ("explicit", "direct", "reasoning", "contextual"), name
        assert plain_settings(task)[4:] == sides, name


NUMBERS_OF_OTHER_GOALS = {
    "PickXtimes": [0, 2, 2], "StopCube": [3, 3, 3], "SwingXtimes": [2, 8, 8],
    "BinFill": [0, 1, 7], "VideoUnmaskSwap": [5, 2, 5], "VideoUnmask": [2, 2, 5],
    "ButtonUnmaskSwap": [5, 2, 5], "ButtonUnmask": [2, 2, 5], "VideoRepick": [0, 0, 0],
    "VideoPlaceButton": [1, 5, 5], "VideoPlaceOrder": [3, 8, 5], "PutInBox": [1, 1, 1],
    "PickByCount": [1, 1, 1],
}  # fmt: skip
"""How many goals of a scene take as many picks as its own and are not on the way, by episode."""


@each_task
def test_the_number_of_goals_that_can_replace_that_of_an_episode_is_stable(task):
    """Control runs command another goal of the same scene, which needs
    as many picks and is not reached on the way to the right one."""
    episodes = [get_episode(task, "test", index) for index in (0, 2, 3)]
    assert [len(other_goals(episode)) for episode in episodes] == NUMBERS_OF_OTHER_GOALS[task]


@each_task
@pytest.mark.parametrize("difficulty", DIFFICULTIES)
def test_same_seed_same_episode_other_seed_other_scene(task, difficulty):
    """Two seeds that give a scene, and the first one made again."""
    first, second = first_episodes(task, difficulty, 2)
    again = make_episode(task, first.seed, difficulty)

    assert again == first
    assert hash(again) == hash(first)
    assert first.scene != second.scene


@each_task
def test_the_goal_of_an_episode_is_one_of_several_different_goals_of_its_scene(task):
    for episode in episodes(task):
        goals = get_task(task).goals(episode.scene)
        assert episode.goal in goals
        assert len(set(goals)) == len(goals) > 1


@each_task
def test_every_goal_of_a_scene_has_a_plan_of_its_own(task):
    for difficulty in DIFFICULTIES:
        (episode,) = first_episodes(task, difficulty)
        goals = get_task(task).goals(episode.scene)
        plans = [get_task(task).stages(episode.scene, goal) for goal in goals]
        assert all(plans)
        assert len(set(plans)) == len(plans)
        assert get_task(task).stages(episode.scene, episode.goal) == episode.stages


def names_moved(motion):
    """Every name that a motion speaks of."""
    match motion:
        case Swap():
            return {motion.first, motion.second, *motion.pinned}
        case Away():
            return {motion.subject, motion.under} - {None}
        case Glow(during=fact) | Vanish(when=fact) | Shuttle(stopped_by=fact):
            return {motion.subject, fact.subject, fact.place} - {None}
    raise AssertionError(motion)


@each_task
def test_stages_and_motions_name_only_objects_of_the_scene(task):
    for episode in episodes(task):
        objects = {item.name for item in episode.scene.objects}
        assert len(objects) == len(episode.scene.objects)
        for stage in (*episode.demonstration, *episode.stages):
            # Its facts are checked by `check_stages` wherever an episode is made.
            handled = {stage.primitive.subject, stage.primitive.place, stage.points_at}
            assert handled <= objects | {"robot", None}
            assert stage.expects not in stage.forbids
            assert ("{at}" in stage.subgoal) == (stage.points_at is not None)
        for motion in episode.scene.motions:
            assert names_moved(motion) <= objects
        for fact in episode.scene.past:
            assert {fact.subject, fact.place} - {None} <= objects
        assert {item.inside for item in episode.scene.objects} - {None} <= objects
        assert bool(episode.scene.past) <= bool(episode.demonstration)


def solid_areas(scene):
    """The areas that nothing else may stand on."""
    footprints = dict.fromkeys(("cube", "container", "bin", "button", "box"), footprint)
    footprints["tape"] = lambda tape: Circle(*tape.position[:2], object_sizes.TAPE_RADIUS)
    return [footprints[item.kind](item) for item in scene.objects if item.kind in footprints]


def disc_areas(scene, *kinds):
    """Targets or sites, but for the one over which a shuttle runs: its place is free."""
    if scene.of_kind("shuttle"):
        return []
    return [
        Circle(item.position.x, item.position.y, item.radius)
        for kind in kinds
        for item in scene.of_kind(kind)
    ]


@each_task
def test_things_on_the_table_do_not_touch(task):
    """Solid things and targets keep apart, and targets and sites; a cube may lie on a site."""
    for episode in episodes(task):
        # Cubes may lie where the video puts one back, as in RoboMME.
        for areas in (
            [*solid_areas(episode.scene), *disc_areas(episode.scene, "target")],
            disc_areas(episode.scene, "target", "site"),
        ):
            assert not any(overlap(*pair) for pair in itertools.combinations(areas, 2)), episode.key


@each_task
def test_hidden_cubes_are_in_the_middle_of_their_containers(task):
    """So that a cube is under the container that the video shows over it."""
    for episode in episodes(task):
        for cube in episode.scene.of_kind("hidden_cube"):
            assert cube.position[:2] == episode.scene[cube.inside].position[:2]


@each_task
def test_objects_lie_on_the_table_and_those_to_handle_are_within_reach(task):
    """`REACH` is 0.85 m from the robot's base, in the plane."""
    for episode in episodes(task):
        for item in episode.scene.objects:
            heights = HEIGHTS[item.kind]
            assert any(item.position.z == pytest.approx(height, abs=1e-6) for height in heights), (
                item
            )
        for stage in (*episode.demonstration, *episode.stages):
            handled = {stage.primitive.subject, stage.primitive.place} - {None, "robot"}
            for x, y, _ in (episode.scene[name].position for name in handled):
                assert np.hypot(x - ROBOT_BASE[0], y - ROBOT_BASE[1]) <= REACH


@each_task
def test_the_front_camera_s_picture_contains_every_object(task):
    """Projects each object's origin to pixels (u, v) of the picture, 256 by 256."""
    for episode in episodes(task):
        for item in episode.scene.objects:
            right, down, ahead = FRONT_CAMERA @ (*item.position, 1)
            u = CENTER + FOCAL * right / ahead
            v = CENTER + FOCAL * down / ahead
            assert ahead > 0
            assert 0 <= u < 256, item
            assert 0 <= v < 256, item
