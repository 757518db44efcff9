"""Landmarks: phrases for where an object stands, such as *closest to the button*.

A phrase is said only of an object that leads all others by the margin of 3 cm. In the scenes here,
places are points (x, y) in meters on the table: x grows away from the robot, y to the robot's left.
"""

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from language_variants import SPATIAL_TASKS, containers, random_episodes, said_where_possible

from roboirg.core.episode import COLORS, SPLITS, Point, Scene, SceneObject
from roboirg.core.instruction_options import InstructionOptions
from roboirg.core.motions import Away
from roboirg.language.landmarks import FRAMES, MARGIN, selectors, things_of_color
from roboirg.language.places import things_at
from roboirg.tasks import get_task
from roboirg.tasks.splits.published_episodes import published_episode

each_task_with_places = pytest.mark.parametrize("task", SPATIAL_TASKS)
coordinates = st.integers(-17, 17).map(lambda centimeters: centimeters / 100)
two_to_eight_places = st.lists(
    st.tuples(coordinates, coordinates), min_size=2, max_size=8, unique=True
)
"""Points of a grid of centimeters, on which ties and leads of exactly the margin are common."""


def cubes(*places):
    """Return a scene with cube_red, cube_green, cube_blue at these places, button and target."""
    button = SceneObject("button", "button", Point(-0.2, 0.0, 0.0))
    target = SceneObject("target", "target", Point(0.0, 0.1, 0.0))
    objects = [button, target]
    for color, (x, y) in zip(COLORS, places, strict=False):
        objects.append(SceneObject(f"cube_{color}", "cube", Point(x, y, 0.02), color=color))
    return Scene(tuple(objects))


def name_called(scene, phrase, kind="container", frame="robot"):
    """Return the name of the object of a kind that a phrase singles out; None if there is none."""
    for selector in selectors(scene, kind, frame):
        thing = selector.select()
        if selector.phrase == phrase and thing is not None:
            return thing.name
    return None


def published_episodes_of(task):
    """Return every seventh episode that RoboMME published for a task, of each split."""
    found = []
    for split in SPLITS:
        found += [published_episode(task, split, index) for index in range(0, 100, 7)]
    return [episode for episode in found if episode is not None]


@pytest.mark.parametrize("frame", FRAMES)
@each_task_with_places
def test_in_published_scenes_words_of_place_single_out_a_goal_object(task, frame):
    """`things_at` has all objects that some words of place single out. In RoboMME's scenes at least
    one of them has a color of the goal: a cube, or the container over it. Else the spatial setting
    had no words for this goal."""
    kind = get_task(task).things.pointed

    for episode in published_episodes_of(task):
        goal = episode.goal.as_mapping()
        objects = []
        for color in goal.get("colors") or [goal["color"]]:
            objects += things_of_color(episode.scene, kind, color)
        singled_out = things_at(episode.scene, kind, frame).values()

        assert any(item in singled_out for item in objects), episode.key


@pytest.mark.parametrize(
    ("phrase", "how_far"),
    [
        ("farthest to your left", lambda x, y: y),
        ("farthest to your right", lambda x, y: -y),
        ("closest to you", lambda x, y: -x),
        ("farthest from you", lambda x, y: x),
    ],
    ids=["left", "right", "near", "far"],
)
@settings(max_examples=40)
@given(places=two_to_eight_places)
def test_a_superlative_is_used_only_if_it_is_true_by_the_margin(phrase, how_far, places):
    """Places are (x, y) in meters: x grows away from the robot, y to its left. A phrase is said of
    the container that lies farthest in its direction, by `how_far`, if it leads the second one by 3
    cm (MARGIN); else of none. *Farthest to your left*: the one with the largest y."""
    distances = [how_far(*place) for place in places]
    second, first = sorted(distances)[-2:]
    expected = f"container_{distances.index(first)}" if first - second >= MARGIN else None

    assert name_called(containers(*places), phrase) == expected


@pytest.mark.parametrize(
    ("lead", "expected"),
    [
        (0.0, None),
        (0.015, None),
        (math.nextafter(0.03, 0.0), None),
        (0.03, "container_0"),
    ],
    ids=["no lead", "half the margin", "hardly less than the margin", "the margin"],
)
def test_a_lead_of_exactly_the_margin_is_enough_for_a_superlative(lead, expected):
    """Places are (x, y) in meters, and y grows to the robot's left. container_0 stands by `lead`
    farther to the left than the other one. The margin from which on it is said to be the farthest
    is 3 cm."""
    scene = containers((0.0, lead), (0.0, 0.0))
    assert name_called(scene, "farthest to your left") == expected


@pytest.mark.parametrize(
    "phrase",
    [
        "farthest to your left",
        "farthest to your right",
        "at your far left",
        "at your far right",
        "closest to you",
        "farthest from you",
    ],
)
def test_every_superlative_applies_to_a_single_cube(phrase):
    """The only cube stands in the middle of the table. As there is no other, it leads in every
    direction."""
    scene = cubes((0.0, 0.0))
    assert name_called(scene, phrase, "cube") == "cube_red"


@pytest.mark.parametrize(
    ("phrase", "expected"),
    [
        ("second from your left", "container_3"),
        ("third from your left", "container_2"),
        ("third from your right", "container_2"),
    ],
)
def test_objects_in_a_row_are_counted_from_either_side(phrase, expected):
    """Places are (x, y) in meters, and y grows to the robot's left. Five containers stand in a row,
    container_0 on the robot's right, container_4 on its left."""
    row = containers((0.0, -0.16), (0.0, -0.08), (0.0, 0.0), (0.0, 0.08), (0.0, 0.16))
    assert name_called(row, phrase) == expected


@pytest.mark.parametrize("phrase", ["fourth from your left", "fourth from your right"])
def test_the_middle_one_of_seven_is_the_fourth_from_either_side(phrase):
    """Places are (x, y) in meters, and y grows to the robot's left. Seven containers stand in a
    row, so container_3 is in the middle."""
    row = containers(
        (0.0, -0.15), (0.0, -0.1), (0.0, -0.05), (0.0, 0.0), (0.0, 0.05), (0.0, 0.1), (0.0, 0.15)
    )
    assert name_called(row, phrase) == "container_3"


@pytest.mark.parametrize(
    ("frame", "phrase"),
    [
        ("robot", "farthest to your left"),
        ("robot", "at your far left"),
        ("camera", "farthest to the camera's right"),
    ],
)
def test_the_robot_s_left_is_the_right_of_the_camera_that_faces_it(frame, phrase):
    """Places are (x, y) in meters, and y grows to the robot's left. container_0 stands 15 cm to the
    robot's left, container_1 as far to its right. The frame is the point of view: the robot's, or
    that of the camera that faces it."""
    scene = containers((0.0, 0.15), (0.0, -0.15))
    assert name_called(scene, phrase, frame=frame) == "container_0"


@pytest.mark.parametrize(
    ("frame", "phrase"), [("robot", "closest to you"), ("camera", "closest to the robot")]
)
def test_near_and_far_are_the_robot_s_in_both_frames(frame, phrase):
    """Places are (x, y) in meters, and x grows away from the robot. container_0 is nearer to the
    robot; the camera on the other side of the table is nearer to container_1, but its words are of
    the robot, too."""
    scene = containers((-0.15, 0.0), (0.15, 0.0))
    assert name_called(scene, phrase, frame=frame) == "container_0"


def test_at_your_far_right_is_not_said_of_a_thing_in_the_near_right_corner():
    """Places are (x, y) in meters: x grows away from the robot, y to its left. container_1 is the
    rightmost one, but near; *at your far right* could mean the far right corner, from which
    container_0 is less far."""
    scene = containers((0.1, 0.0), (-0.2, -0.15))

    assert name_called(scene, "farthest to your right") == "container_1"
    assert name_called(scene, "at your far right") is None


SIX_PLACES = [
    (-0.15, 0.02), (0.12, -0.14), (0.04, 0.16), (-0.05, -0.09), (0.16, 0.07), (0.0, 0.0)
]  # fmt: skip
BUTTON_IN_FRONT = SceneObject("button", "button", Point(-0.2, 0.0, 0.0))


@pytest.mark.parametrize(
    "scene",
    [
        cubes(*SIX_PLACES[:3]),
        Scene((BUTTON_IN_FRONT, *containers(*SIX_PLACES[:4]).objects)),
        Scene((BUTTON_IN_FRONT, *containers(*SIX_PLACES).objects)),
    ],
    ids=["3", "4", "6"],
)
def test_a_place_has_these_words_and_no_others(scene, snapshot):
    """The full list of phrases with their objects in scenes of 3 cubes, and of 4 and 6 containers,
    compared with a stored one. A phrase that is lost or added changes no published text as long as
    others can be said, so only this list shows it."""
    found = []
    for selector in selectors(scene, scene.objects[-1].kind, "robot"):
        thing = selector.select()
        if thing is not None:
            found.append(f"{selector.phrase}: {thing.name}")

    assert found == snapshot


def test_left_and_right_of_the_camera_follow_its_picture_and_not_the_table():
    """Places are (x, y) in meters: x grows away from the robot, y to its left; the camera faces the
    robot. What is farther away from it appears nearer to the middle of its picture. container_1
    stands 3 cm farther to the robot's left than container_0, but so much farther from the camera
    that the picture shows container_0 farther to the right."""
    scene = containers((0.2, 0.135), (-0.2, 0.165))

    assert name_called(scene, "farthest to your left") == "container_1"
    assert name_called(scene, "farthest to the camera's right", frame="camera") == "container_0"


def test_a_corner_phrase_is_dropped_if_work_area_and_table_corner_disagree():
    """A listener may think of the corner of the area where things stand, at (-0.3, 0.25), or of the
    corner of the table, at (-0.74, 1.2). container_0 at (-0.11, 0.06) is 0.27 m from the first and
    1.30 m from the second; container_1 at (0.0, 0.17) is 0.31 and 1.27 m from them. So each is the
    nearest for one listener, and *closest to your near left corner* is not said."""
    scene = containers((-0.11, 0.06), (0.0, 0.17), (-0.11, -0.2), (0.0, -0.2), (0.1, 0.17))

    assert name_called(scene, "closest to your near left corner") is None


@pytest.mark.parametrize("place", [(-0.11, 0.06), (0.0, 0.17)])
def test_a_corner_phrase_is_said_of_either_container_without_the_other(place):
    """container_0 is one of two between which *closest to your near left corner* is not clear, but
    the other one is not there. The three others are farther from the corner of the area and of the
    table."""
    scene = containers(place, (-0.11, -0.2), (0.0, -0.2), (0.1, -0.17))

    assert name_called(scene, "closest to your near left corner") == "container_0"


@each_task_with_places
def test_places_in_the_camera_frame_never_say_you(task):
    """The robot is *you*. The metadata of 40 instructions from the camera's point of view have the
    words of the place; these must not mix in the robot's point of view."""
    options = InstructionOptions("spatial", frame="camera")
    for _, said in said_where_possible(random_episodes(task, 40), options):
        (place,) = said.metadata["landmarks"]
        assert {"you", "your"}.isdisjoint(place.split()), place


def test_a_cube_that_arrives_later_is_not_compared_with_the_others():
    """Places are (x, y) in meters, and y grows to the robot's left. The red cube stands farthest to
    the left, but the motion `Away` keeps it off the table until step 50. Before, the green cube is
    the leftmost one."""
    scene = cubes((0.1, 0.15), (0.0, 0.0), (0.0, -0.15))
    late = Scene(scene.objects, motions=(Away("cube_red", 0, 50),))

    assert name_called(scene, "farthest to your left", "cube") == "cube_red"
    assert name_called(late, "farthest to your left", "cube") == "cube_green"


def test_a_cube_that_arrives_later_has_no_words_for_its_place():
    """The motion `Away` keeps the red cube off the table for the first 50 steps, and the words are
    heard before. So no phrase of place may select it."""
    scene = cubes((0.0, 0.15), (0.0, -0.15), (0.1, 0.0))
    late = Scene(scene.objects, motions=(Away("cube_red", 0, 50),))

    selected = [selector.select() for selector in selectors(late, "cube", "robot")]

    assert late["cube_red"] not in selected


@pytest.mark.parametrize("phrase", ["farthest to your left", "at your far left"])
def test_containers_that_appear_during_the_video_can_be_named_by_place(phrase):
    """Places are (x, y) in meters, and y grows to the robot's left. The motion `Away` keeps both
    containers off the table until step 32. Unlike cubes, containers all come up at the same time,
    so they are compared."""
    scene = containers((0.0, 0.15), (0.0, -0.15))
    motions = (Away("container_0", 0, 32), Away("container_1", 0, 32))

    assert name_called(Scene(scene.objects, motions=motions), phrase) == "container_0"


def test_cubes_can_be_named_by_their_distance_to_the_bin():
    """A point is (x, y, z) in meters. The red cube stands 10 cm from the bin, the green one 30
    cm."""
    scene = Scene(
        (
            SceneObject("bin", "bin", Point(-0.2, 0.0, 0.0)),
            SceneObject("cube_red", "cube", Point(-0.1, 0.0, 0.02), color="red"),
            SceneObject("cube_green", "cube", Point(0.1, 0.0, 0.02), color="green"),
        )
    )
    assert name_called(scene, "closest to the bin", "cube") == "cube_red"
    assert name_called(scene, "farthest from the bin", "cube") == "cube_green"


def test_in_binfill_the_place_that_is_said_has_a_cube_of_a_goal_color():
    """*My boss hates the color of the cube second from the right* must lead to a goal's color. The
    metadata of an instruction have the words of the place, and `things_at` the cube that they
    select."""
    options = InstructionOptions("spatial")
    for episode, said in said_where_possible(random_episodes("BinFill", 30), options):
        (place,) = said.metadata["landmarks"]
        cube = things_at(episode.scene, "cube", "robot")[place]
        assert cube.color in episode.goal.texts("colors"), said.text
