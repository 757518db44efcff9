"""Words for places as people say them: *all the way on the left*, *right by the button*.

A place has words after a noun (*the cube* **nearest to the button**), or a *spot*, words for where
something happens (*the table wobbles* **on the left**), or both. In the scenes here, places are
points (x, y) in meters on the table: x grows away from the robot, y to the robot's left.
"""

import itertools
import math
from collections import defaultdict
from dataclasses import replace

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from language_variants import random_episodes, split_episodes
from selection import slow_but

from roboirg.core.episode import COLORS, Point, Scene, SceneObject
from roboirg.core.instruction_options import InstructionOptions
from roboirg.core.motions import Away
from roboirg.language import instruct
from roboirg.language.clues import thing_clues
from roboirg.language.generator import find_refusal, request_of
from roboirg.language.landmarks import FRAMES, selectors
from roboirg.language.places import PlaceClass, spoken_places, things_at
from roboirg.language.scenarios.choice import choose
from roboirg.language.scenarios.scenario_file import read_task_scenarios
from roboirg.tasks import all_tasks, get_task
from roboirg.tasks.splits.splits import get_episode

UNMASK = ("VideoUnmask", "VideoUnmaskSwap", "ButtonUnmask", "ButtonUnmaskSwap")
TASKS_CHECKED_MORE = ("PickXtimes", "SwingXtimes", "StopCube", *UNMASK)
each_task = pytest.mark.parametrize("task", slow_but(TASKS_CHECKED_MORE, all_tasks()))
each_task_with_places = pytest.mark.parametrize("task", ["PickXtimes", *UNMASK])
BUTTON = ("button", (-0.2, 0.0))
TARGET = ("target", (0.1, 0.0))
coordinates = st.integers(-17, 17).map(lambda centimeters: centimeters / 100)
one_to_seven_places = st.lists(
    st.tuples(coordinates, coordinates), min_size=1, max_size=7, unique=True
)
"""Points of a grid of centimeters, on which ties and leads of exactly the margin are common."""


def test_an_episode_has_the_places_of_the_frame_whatever_was_said_of_it_before():
    """The frame is whose left and right is meant. The camera faces the robot, so the robot's left
    is on the right of the picture. Both frames are asked for twice in turn: neither may get what
    was made for the other."""
    episode = get_episode("PickXtimes", "test", 0)
    for _ in range(2):
        of_robot = instruct(episode, "spatial", frame="robot").metadata["landmarks"]
        of_camera = instruct(episode, "spatial", frame="camera").metadata["landmarks"]

        assert of_robot == ["on the left"]
        assert of_camera == ["on the right of the picture"]


def containers(places, *fixtures):
    """Return a scene with container_0, container_1 … at these places, and other things.

    These are given as (kind, place), such as ``("button", (-0.2, 0.0))``.
    """
    found = [SceneObject(kind, kind, Point(*at, 0.0)) for kind, at in fixtures]
    for number, (x, y) in enumerate(places):
        found.append(SceneObject(f"container_{number}", "container", Point(x, y, 0.05)))
    return Scene(tuple(found))


def cubes(*places):
    """Return a scene with cube_red, cube_green and cube_blue, as many as there are places."""
    found = []
    for color, (x, y) in zip(COLORS, places, strict=False):
        found.append(SceneObject(f"cube_{color}", "cube", Point(x, y, 0.02), color=color))
    return Scene(tuple(found))


def words_with_things(places):
    """Yield all words of places, those after a noun and spots, each with its thing."""
    for place in places:
        for words in (place.attributive, place.spot):
            if words:
                yield words, place.thing


def names_by_phrase(scene, kind="container", frame="robot"):
    """Return the name of the thing of each phrase; a phrase of two things fails."""
    found = {}
    for words, thing in words_with_things(spoken_places(scene, kind, frame)):
        assert found.setdefault(words, thing.name) == thing.name, words
    return found


def everyday_places(scene, kind="container", frame="robot"):
    """Return the places that people name, without those that are said if there is nothing else."""
    return [place for place in spoken_places(scene, kind, frame) if place.kind < PlaceClass.UNUSUAL]


def phrases_after_a_noun(scene, name, kind="container", frame="robot"):
    """Return the everyday words after a noun for a thing: *the cube* **in the middle**."""
    places = everyday_places(scene, kind, frame)
    return {place.attributive for place in places if place.thing.name == name and place.attributive}


def things_by_spot(scene, kind="container", frame="robot"):
    return {place.spot: place.thing for place in spoken_places(scene, kind, frame) if place.spot}


def scenes_of(task):
    """Return the scenes of all published episodes, and for some tasks 200 more."""
    episodes = list(split_episodes(task))
    if task in TASKS_CHECKED_MORE:
        episodes += random_episodes(task, 200)
    return [episode.scene for episode in episodes]


@each_task
def test_a_phrase_means_the_same_object_for_the_robot_and_for_the_camera(task):
    """The frame is the point of view: the camera faces the robot, so that sides differ. What both
    may say, such as *nearest to the button*, must select the same object for both. So it names no
    side, *on the left*; the camera says *on the left of the picture*. The *right* of *right by the
    button* is none."""
    kind = get_task(task).things.pointed
    for scene in scenes_of(task):
        robot = names_by_phrase(scene, kind, "robot")
        camera = names_by_phrase(scene, kind, "camera")

        for phrase in robot.keys() & camera.keys():
            words = phrase.removeprefix("right by ").split()
            assert robot[phrase] == camera[phrase], phrase
            assert {"left", "right"}.isdisjoint(words), phrase


@each_task
def test_each_phrase_selects_the_object_it_was_made_for(task):
    """`things_at` has the object that each phrase selects for a listener. It must be the one for
    which the phrase was made: for words of places those of `names_by_phrase`; for superlatives,
    such as *farthest to your left*, what their selector finds, which may be None. So it is in all
    scenes, from the robot's and the camera's point of view."""
    kind = get_task(task).things.pointed
    for scene, frame in itertools.product(scenes_of(task), FRAMES):
        heard = things_at(scene, kind, frame)

        for phrase, name in names_by_phrase(scene, kind, frame).items():
            assert heard[phrase].name == name, phrase
        for selector in selectors(scene, kind, frame):
            assert heard[selector.phrase] is selector.select(), selector.phrase


@each_task
def test_everyday_phrases_have_at_most_twelve_words(task):
    """Longer ones are no words that people say: these are checked in all published scenes."""
    kind = get_task(task).things.pointed
    for scene, frame in itertools.product(scenes_of(task), FRAMES):
        for words, _ in words_with_things(everyday_places(scene, kind, frame)):
            assert len(words.split()) <= 12, words


@settings(max_examples=100)
@given(
    places=one_to_seven_places,
    frame=st.sampled_from(FRAMES),
    number=st.integers(0, 6),
    button_y=coordinates,
    direction=st.floats(0, 2 * math.pi),
)
def test_a_small_move_of_one_object_never_makes_a_phrase_mean_another_object(
    places, frame, number, button_y, direction
):
    """An object has everyday words only if it leads all others by 3 cm, such as by being nearer to
    the button. One container moves 2.94 cm in any direction, and button and target stay. Then a
    phrase that was said before may be gone, but cannot have another container."""
    button = ("button", (-0.2, button_y))
    target = ("target", (0.0, -button_y))
    number %= len(places)
    x, y = places[number]
    moved = list(places)
    moved[number] = (x + 0.0294 * math.cos(direction), y + 0.0294 * math.sin(direction))

    before = everyday_places(containers(places, button, target), frame=frame)
    name_after = names_by_phrase(containers(moved, button, target), frame=frame)

    for words, thing in words_with_things(before):
        if words in name_after:
            assert name_after[words] == thing.name, words


@pytest.mark.parametrize(("frame", "robot"), [("robot", "you"), ("camera", "the robot")])
def test_near_and_far_are_not_said_where_depth_and_distance_from_the_robot_disagree(frame, robot):
    """*Closest* can mean the smallest depth (x) or the smallest distance from the robot's base.

    container_0 has the smaller depth, by 6 cm, and container_1 the smaller distance, by 1 cm.
    """
    scene = containers([(-0.2, 0.25), (-0.14, 0.0)])

    phrases = names_by_phrase(scene, frame=frame)

    assert phrases.keys().isdisjoint(
        {
            f"closest to {robot}", f"close to {robot}",
            f"far from {robot}", f"farthest from {robot}",
            "in the front", "in the back", "all the way in the front", "all the way in the back",
        }
    )  # fmt: skip


@pytest.mark.parametrize(
    ("other", "words"),
    [
        ((0.02, 0.02), {"nearest to the back left corner"}),
        ((-0.02, 0.15), set()),
        ((-0.2, -0.2), {"at the back left", "in the back left corner"}),
    ],
    ids=["in the same quarter", "hardly outside of it", "far away"],
)
def test_nothing_is_in_a_corner_if_another_thing_is_near_that_corner(other, words):
    """Places are (x, y) in meters: x grows away from the robot, y to its left. container_0 stands
    in the back left quarter; `other` is where container_1 stands. In the same quarter, only
    *nearest to the corner* is right; hardly outside of it, nothing is said; far away, container_0
    is in the corner."""
    scene = containers([(0.1, 0.1), other, (-0.3, 0.0), (0.2, -0.2)])
    of_the_corner = {
        "nearest to the back left corner", "at the back left", "in the back left corner",
    }  # fmt: skip

    assert phrases_after_a_noun(scene, "container_0") & of_the_corner == words
    assert phrases_after_a_noun(scene, "container_1").isdisjoint(of_the_corner)


def spots_of(scene):
    """Return the spots of a scene with containers, each with the number of its container."""
    found = {}
    for spot, thing in things_by_spot(scene).items():
        found[spot] = int(thing.name.removeprefix("container_"))
    return found


def test_in_a_row_only_the_first_and_the_last_thing_have_a_spot():
    """A spot says where something happens: *There's a stain on the far right.*

    Five containers stand in a row: 0 on the robot's right, 4 on its left.
    """
    assert spots_of(ROW_OF_FIVE) == {"on the far left": 4, "on the far right": 0}


def test_the_things_of_a_square_have_spots_in_its_corners():
    """Points are (x, y): x grows away from the robot, y to its left.

    So containers 0 and 1 stand in front, 0 and 2 on the left. *On the left* would mean two.
    """
    square = containers([(-0.15, 0.15), (-0.15, -0.15), (0.15, 0.15), (0.15, -0.15)])

    assert spots_of(square) == {
        "at the front left": 0,
        "in the front left corner": 0,
        "at the front right": 1,
        "in the front right corner": 1,
        "at the back left": 2,
        "in the back left corner": 2,
        "at the back right": 3,
        "in the back right corner": 3,
    }


def test_things_that_stand_apart_have_spots_in_every_direction():
    """Container 0 stands between button and target, 1 next to the button, 2 in the back.

    x grows away from the robot, y to its left: so 1 (y = 0.09) is the leftmost and 2 (y = -0.2)
    the rightmost one. The numbers are those of the containers.
    """
    scene = containers([(-0.05, -0.03), (-0.19, 0.09), (0.1, -0.2)], BUTTON, TARGET)

    assert spots_of(scene) == {
        "on the far left": 1,
        "on the left": 1,
        "on the far right": 2,
        "on the right": 2,
        "all the way in the front": 1,
        "in the front": 1,
        "all the way in the back": 2,
        "in the back": 2,
        "right by the button": 1,
        "between the button and the target": 0,
        "in the middle": 0,
        "at the front left": 1,
        "at the back right": 2,
        "in the back right corner": 2,
    }


UNUSUAL_EPISODES = pytest.mark.parametrize(
    ("task", "index", "words"),
    [
        ("VideoUnmask", 10, "third closest to you"),
        ("BinFill", 34, "nearest to the cube closest to your far left corner"),
    ],
    ids=["rank", "neighbor"],
)
"""Episodes whose object has only words that no one says."""


@UNUSUAL_EPISODES
def test_an_object_with_unusual_words_only_is_refused_by_the_grounded_setting(task, index, words):
    """For the object of the goal only words are left that no one would say, such as *third closest
    to you*. The setting *grounded* says only words that people would say, so it refuses the
    episode."""
    episode = get_episode(task, "test", index)
    refusal = find_refusal(episode, InstructionOptions("grounded"))
    assert refusal == "nothing to see in this scene singles out a slot's value"


@UNUSUAL_EPISODES
def test_an_object_with_unusual_words_only_is_still_named_by_the_spatial_setting(
    task, index, words
):
    """For the object of the goal only words are left that no one would say. The setting *spatial*
    has to name a place, so it takes them, and the metadata say that they are unusual."""
    said = instruct(get_episode(task, "test", index), "spatial")

    assert words in said.text
    assert said.metadata["landmark_classes"] == [PlaceClass.UNUSUAL]


ROW_OF_FIVE = containers([(0.0, -0.16), (0.0, -0.08), (0.0, 0.0), (0.0, 0.08), (0.0, 0.16)])
"""container_0 stands on the robot's right, container_4 on its left, as far away."""


@pytest.mark.parametrize(
    ("name", "phrase"),
    [
        ("container_4", "all the way on the left"),
        ("container_3", "second from the left"),
        ("container_2", "in the middle"),
    ],
)
def test_everyday_words_for_a_row_of_five(name, phrase):
    """ROW_OF_FIVE has five containers in a row: container_0 stands on the robot's right,
    container_2 in the middle, container_4 on its left."""
    assert phrase in phrases_after_a_noun(ROW_OF_FIVE, name)


def test_the_camera_sees_the_robot_s_leftmost_thing_on_the_right_of_the_picture():
    """ROW_OF_FIVE has five containers in a row, container_0 on the robot's right, container_4 on
    its left; the camera faces the robot."""
    phrases = phrases_after_a_noun(ROW_OF_FIVE, "container_4", frame="camera")
    assert phrases == {"all the way on the right of the picture"}


@pytest.mark.parametrize(
    ("name", "phrase"),
    [
        ("container_0", "between the button and the target"),
        ("container_1", "next to the button"),
        ("container_1", "to the left of the button"),
        ("container_2", "farthest from the button"),
    ],
)
def test_everyday_words_for_things_near_a_button_or_a_target(name, phrase):
    """The button stands at (-0.2, 0), the target at (0.1, 0): x grows away from the robot.

    y grows to its left, in meters. So container_1 stands 1 cm behind the button and 9 cm left of
    it.
    """
    scene = containers([(-0.05, -0.03), (-0.19, 0.09), (0.1, -0.2)], BUTTON, TARGET)
    assert phrase in phrases_after_a_noun(scene, name)


def test_what_is_more_behind_the_button_than_beside_it_is_not_to_its_left():
    """The button stands at (-0.2, 0). container_0 stands 15 cm behind it (x) and 4 cm to its left
    (y).
    """
    scene = containers([(-0.05, 0.04), (0.1, -0.2)], BUTTON)
    assert "to the left of the button" not in phrases_after_a_noun(scene, "container_0")


@pytest.mark.parametrize("place", [(0.1, 0.1), (-0.08, 0.0), (-0.2, 0.04)])
def test_a_cube_alone_on_the_table_is_not_described_by_comparison(place):
    """The place is (x, y) in meters. Of a cube that is alone on the table may be said that
    something happens *on the left*, a spot; but no words after a noun (*the leftmost cube*), as
    there is nothing to compare it with, and no corner."""
    places = spoken_places(cubes(place), "cube", "robot")

    assert places
    assert [found.attributive for found in places] == [None] * len(places)
    assert not any("corner" in found.spot for found in places)


@pytest.mark.parametrize("phrase", ["nearest to the red cube", "next to the red cube"])
def test_of_two_cubes_one_is_not_said_to_be_near_the_other(phrase):
    """The red and the green cube are all there is. Where there is no third cube, that one is near
    the other says nothing."""
    scene = cubes((0.0, 0.1), (0.0, 0.0))
    assert phrase not in phrases_after_a_noun(scene, "cube_green", "cube")


def test_places_do_not_depend_on_cubes_that_arrive_later():
    """The motion `Away` keeps the blue cube off the table for the first 100 steps. So the scene has
    the words of one with the red and the green cube alone."""
    two = cubes((0.0, 0.15), (0.0, 0.0))
    three = cubes((0.0, 0.15), (0.0, 0.0), (0.0, -0.15))
    late = replace(three, motions=(Away("cube_blue", 0, 100),))

    assert names_by_phrase(late, "cube") == names_by_phrase(two, "cube")


@each_task_with_places
def test_a_clue_leads_to_one_object(task):
    """A clue describes an object by what can be seen: *the cube in the middle*. `setdefault` keeps
    the first object that its words describe in a scene; another object with the same words
    fails."""
    for scene in scenes_of(task):
        found = {}
        for thing, clue in thing_clues(scene, get_task(task)):
            assert found.setdefault(clue.words, thing.name) == thing.name, clue.words


@each_task_with_places
def test_a_clue_never_leads_to_an_object_that_it_excludes(task):
    """A clue describes an object by what can be seen. One of three cubes may be described by the
    two others: neither the one *on the left* nor the one *next to the button*. `clue.aside` has
    these words; none of them may select the object itself."""
    kind = get_task(task).things.pointed
    for scene in scenes_of(task):
        known = things_at(scene, kind, "robot")
        for thing, clue in thing_clues(scene, get_task(task)):
            assert thing not in [known[words] for words in clue.aside], clue.aside


def only_scenario(introduction):
    """Return a spatial scenario, a template of texts, that begins with these words."""
    text = f"""
tasks = ["PickXtimes"]
[[scenario]]
frame = "one place"
pool = "train"
setting = "spatial"
introduction = "{introduction}"
say.color = ["the cube <there place: there>"]
"""
    (scenario,) = read_task_scenarios(text, "mine.toml")["PickXtimes"].scenarios
    return scenario


def spatial_requests():
    """Yield what is asked of the spatial setting in 40 training episodes."""
    for index in range(40):
        episode = get_episode("PickXtimes", "train", index)
        yield request_of(episode, InstructionOptions("spatial", wordings="train"))


def spots_of_goal_cubes(request):
    """Return the spots of the cubes of the goal's color: *on the left*, *in the middle*."""
    (color,) = request.color_values
    goal_cubes = request.objects_to_point_at(color)
    by_spot = things_by_spot(request.episode.scene, "cube")
    return {spot for spot, cube in by_spot.items() if cube in goal_cubes}


def test_a_story_that_needs_a_spot_is_chosen_only_for_a_cube_with_a_spot():
    """A spot says where something happens, such as *in the middle*. A cube that is only *nearest to
    the button* has none, as nothing wobbles *nearest to the button*. `request` is what the setting
    *spatial* is asked for one of 40 episodes; `choose` returns the story with its landmark, or
    None."""
    story = only_scenario("The table wobbles {place:spot}.")
    landmarks = []

    for request in spatial_requests():
        spots = spots_of_goal_cubes(request)
        chosen = choose(request, "spatial", [story])

        assert bool(chosen) == bool(spots), request.episode.key
        if chosen:
            landmarks += chosen.plan.notes["landmarks"]
            assert landmarks[-1] in spots

    assert landmarks


@pytest.mark.parametrize(
    ("task", "noun"),
    [
        ("VideoUnmask", "the container"),
        ("VideoUnmaskSwap", "the container that started"),
        ("ButtonUnmask", "the cube"),
        ("ButtonUnmaskSwap", "the cube"),
    ],
)
def test_only_containers_that_change_places_are_said_to_have_started_somewhere(task, noun):
    """A clue describes an object: its words are the noun of the task and words of place, as in *the
    container that started* **on the left**. Only in VideoUnmaskSwap do containers move after they
    were seen. In the tasks with buttons, the words are heard before containers come down on the
    cubes."""
    kind = get_task(task).things.pointed
    for scene in scenes_of(task):
        thing_by_words = {}
        for place in spoken_places(scene, kind, "robot"):
            thing_by_words[f"{noun} {place.attributive}"] = place.thing

        for thing, clue in thing_clues(scene, get_task(task)):
            if clue.kind != "sets":  # which names two others by their places, and not the thing
                assert thing_by_words[clue.words] is thing, clue.words


def test_a_place_at_the_start_means_a_cube_and_the_container_that_covers_it_later():
    """The video of VideoUnmaskSwap first shows cubes, and then containers that come down on them.
    *On the left at the start* may be meant of either: where both a cube and a container that covers
    one have these words (a spot), it must be that cube's container."""
    cubes_with_the_words_of_a_container = []
    for scene in scenes_of("VideoUnmaskSwap"):
        cube_by_spot = things_by_spot(scene, "hidden_cube")
        covering = {cube.inside for cube in scene.of_kind("hidden_cube")}
        for spot, container in things_by_spot(scene, "container").items():
            if spot in cube_by_spot and container.name in covering:
                cubes_with_the_words_of_a_container.append(cube_by_spot[spot])
                assert cube_by_spot[spot].inside == container.name, spot

    assert cubes_with_the_words_of_a_container


def phrases_by_class():
    """Return the phrases of places in every fifth published scene of all tasks, for each class,
    point of view and use: ``("SIDE", "robot", "spot")`` has *on the left*."""
    found = defaultdict(set)
    for task in all_tasks():
        kind = get_task(task).things.pointed
        episodes = itertools.islice(split_episodes(task), 0, None, 5)
        for episode, frame in itertools.product(episodes, FRAMES):
            for place in everyday_places(episode.scene, kind, frame):
                found[place.kind.name, frame, "after a noun"].add(place.attributive)
                found[place.kind.name, frame, "spot"].add(place.spot)
    return found


def test_the_phrases_of_places_by_class(snapshot):
    """A line for each class of phrases, such as *SIDE, robot, spot: on the left; on the right*.
    The stored lines are what people agreed to say: a phrase that is lost, added, or moved to
    another class is read in the difference, since no published text need show it."""
    lines = []
    for (kind, frame, use), phrases in sorted(phrases_by_class().items()):
        said = sorted(phrases - {None})
        if said:
            lines.append(f"{kind}, {frame}, {use}: {'; '.join(said)}")

    assert "\n".join(lines) == snapshot
