"""Places as people say them: one thing each, by the margin, and spots that are true."""

import itertools
import math
import re
from collections import defaultdict
from dataclasses import replace

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from language_variants import random_episodes, split_episodes
from selection import slow_but
from wording_stand_ins import WOBBLY

from roboirg.core.episode import COLORS, ROBOT_BASE, Point, Scene, SceneObject
from roboirg.core.instruction_options import InstructionOptions
from roboirg.core.motions import Away
from roboirg.core.object_sizes import BESIDE
from roboirg.language import instruct
from roboirg.language.clues import thing_clues
from roboirg.language.generator import find_refusal, request_of
from roboirg.language.landmarks import FRAMES, MARGIN, candidates_in, selectors
from roboirg.language.places import PlaceClass, spoken_places, things_at
from roboirg.language.scenarios.choice import choose
from roboirg.language.scenarios.scenario_file import read_task_scenarios
from roboirg.tasks import all_tasks, get_task
from roboirg.tasks.splits.splits import get_episode

UNMASK = ("VideoUnmask", "VideoUnmaskSwap", "ButtonUnmask", "ButtonUnmaskSwap")
TASKS_CHECKED_MORE = ("PickXtimes", "SwingXtimes", "StopCube", *UNMASK)
TASKS_WITH_PLACES = ("PickXtimes", *UNMASK)
NEAR_AND_FAR = {
    f"{words} {whom}"
    for words in ("closest to", "close to", "far from", "farthest from")
    for whom in ("you", "the robot")
} | {"in the front", "in the back", "all the way in the front", "all the way in the back"}
GRID = st.integers(-17, 17).map(lambda step: step / 100)
PLACES = st.lists(st.tuples(GRID, GRID), min_size=1, max_size=7, unique=True)
"""Centimeter grid: ties, exact margins and collinear rows are common."""
MOST_WORDS = 12
NOTHING_TO_SEE = "nothing to see in this scene singles out a slot's value"


def test_an_episode_has_the_places_of_the_frame_whatever_was_said_of_it_before():
    """The robot's left is on the right of the picture."""
    episode = get_episode("PickXtimes", "test", 0)
    for _ in range(2):
        of_robot = instruct(episode, "spatial", frame="robot").metadata["landmarks"]
        of_camera = instruct(episode, "spatial", frame="camera").metadata["landmarks"]

        assert of_robot == ["on the left"]
        assert of_camera == ["on the right of the picture"]


def scene_with_containers(places, *fixtures):
    """Return a scene with containers, and fixtures by kind and place."""
    found = [SceneObject(kind, kind, Point(*at, 0.0)) for kind, at in fixtures]
    for number, (x, y) in enumerate(places):
        found.append(SceneObject(f"container_{number}", "container", Point(x, y, 0.05)))
    return Scene(tuple(found))


def scene_with_cubes(*places):
    colored = zip(COLORS, places, strict=False)
    things = [
        SceneObject(f"cube_{color}", "cube", Point(x, y, 0.02), color=color)
        for color, (x, y) in colored
    ]
    return Scene(tuple(things))


def words_of(places):
    """Yield every wording with its thing."""
    for place in places:
        for words in (place.attributive, place.spot):
            if words:
                yield words, place.thing


def things_by_phrase(scene, kind="container", frame="robot"):
    """Return the name of the thing of each phrase; a phrase of two things fails."""
    found = {}
    for words, thing in words_of(spoken_places(scene, kind, frame)):
        assert found.setdefault(words, thing.name) == thing.name, words
    return found


def everyday_places(scene, kind="container", frame="robot"):
    return [place for place in spoken_places(scene, kind, frame) if place.kind < PlaceClass.UNUSUAL]


def phrases_after_a_noun(scene, name, kind="container", frame="robot"):
    """Return the usual words after a noun for a thing."""
    places = everyday_places(scene, kind, frame)
    return {place.attributive for place in places if place.thing.name == name and place.attributive}


def things_by_spot(scene, kind="container", frame="robot"):
    return {place.spot: place.thing for place in spoken_places(scene, kind, frame) if place.spot}


def scenes_of(task):
    episodes = list(split_episodes(task))
    if task in TASKS_CHECKED_MORE:
        episodes += random_episodes(task, 200)
    return [episode.scene for episode in episodes]


@pytest.mark.parametrize("task", slow_but(TASKS_CHECKED_MORE, all_tasks()))
def test_a_phrase_means_the_same_object_for_the_robot_and_for_the_camera(task):
    """The frame is the point of view. *Left* and *right* differ in it, so they name it."""
    kind = get_task(task).things.pointed
    for scene in scenes_of(task):
        robot, camera = (things_by_phrase(scene, kind, frame) for frame in FRAMES)
        for words in robot.keys() & camera.keys():
            assert robot[words] == camera[words], words
            assert not re.search(r"\b(left|right)\b(?! by)", words)


@pytest.mark.parametrize("task", slow_but(TASKS_CHECKED_MORE, all_tasks()))
def test_each_phrase_selects_the_object_it_was_made_for_and_everyday_ones_are_short(task):
    kind = get_task(task).things.pointed
    for scene, frame in itertools.product(scenes_of(task), FRAMES):
        known = things_at(scene, kind, frame)
        for words, name in things_by_phrase(scene, kind, frame).items():
            assert known[words].name == name
        for selector in selectors(scene, kind, frame):
            assert known[selector.landmark.phrase] is selector.select()
        for words, _ in words_of(everyday_places(scene, kind, frame)):
            assert len(words.split()) <= MOST_WORDS


@settings(max_examples=100)
@given(PLACES, st.sampled_from(FRAMES), st.integers(0, 6), GRID, st.floats(0, 2 * math.pi))
def test_a_small_move_of_one_object_never_makes_a_phrase_mean_another_object(
    places, frame, mover, button, turn
):
    """Small is less than `MARGIN`, by which a phrase must be clear in the first place.

    `turn` is the direction of the move, `mover` the number of the object.
    """
    fixtures = (("button", (-0.2, button)), ("target", (0.0, -button)))
    step = 0.98 * MARGIN
    moved = list(places)
    x, y = moved.pop(mover % len(places))
    moved.insert(mover % len(places), (x + step * math.cos(turn), y + step * math.sin(turn)))

    before = everyday_places(scene_with_containers(places, *fixtures), frame=frame)
    after = things_by_phrase(scene_with_containers(moved, *fixtures), frame=frame)

    for words, thing in words_of(before):
        assert after.get(words, thing.name) == thing.name, words


@pytest.mark.parametrize("frame", FRAMES)
def test_near_and_far_are_not_said_where_depth_and_distance_from_the_robot_disagree(frame):
    """Closest can mean the smallest depth (x) or the smallest distance from the robot's base.

    One container stands 6 cm deeper than the other, which is 1 cm farther away.
    """
    disagreeing = scene_with_containers([(-0.2, 0.25), (-0.14, 0.0)])
    distances = [math.dist(item.position[:2], ROBOT_BASE[:2]) for item in disagreeing.objects]
    assert distances == pytest.approx([0.484, 0.475], abs=0.001)

    found = things_by_phrase(disagreeing, frame=frame)
    assert NEAR_AND_FAR.isdisjoint(found)

    agreeing = scene_with_containers([(-0.2, 0.0), (-0.14, 0.25)])
    found = things_by_phrase(agreeing, frame=frame)
    robot = "you" if frame == "robot" else "the robot"
    assert found[f"closest to {robot}"] == "container_0"


@pytest.mark.parametrize("task", TASKS_WITH_PLACES)
def test_closest_to_you_is_closest_both_in_depth_and_by_distance(task):
    measures = (
        lambda item: item.position.x,
        lambda item: math.dist(item.position[:2], ROBOT_BASE[:2]),
    )
    kind = get_task(task).things.pointed
    said = 0

    for scene in scenes_of(task):
        things = candidates_in(scene, kind)
        known = things_at(scene, kind, "robot")
        own = things_by_phrase(scene, kind)
        for measure in measures:
            order = sorted(things, key=measure)
            ranks = {
                "closest to you": 0,
                "all the way in the front": 0,
                "second closest to you": 1,
                "all the way in the back": -1,
            }
            for words in own.keys() & ranks.keys():
                assert known[words] is order[ranks[words]], words
                said += 1

    assert said


@pytest.mark.parametrize(
    ("other", "words"),
    [
        ((0.02, 0.02), {"nearest to the back left corner"}),  # in the same quarter
        ((-0.02, 0.15), set()),  # hardly outside of it, and about as near to the corner
        ((-0.2, -0.2), {"at the back left", "in the back left corner"}),
    ],
)
def test_nothing_is_in_a_corner_if_another_thing_is_near_that_corner(other, words):
    """container_0 stands in the back left quarter; `other` is where container_1 stands."""
    scene = scene_with_containers([(0.1, 0.1), other, (-0.3, 0.0), (0.2, -0.2)])
    corner = {"nearest to the back left corner", "at the back left", "in the back left corner"}

    assert phrases_after_a_noun(scene, "container_0") & corner == words
    assert not corner.intersection(phrases_after_a_noun(scene, "container_1"))


def gap(thing, fixture):
    """Return the distance of two outlines."""
    distance = math.dist(thing.position[:2], fixture.position[:2])
    return distance - thing.half_width - fixture.half_width


def is_there(spot, thing, scene, middle):
    """Return whether a thing is at a spot, by what its words mean; `middle` is the depth of it."""
    x, y, _ = thing.position
    by = re.fullmatch(r"right by the (\w+)", spot)
    if by:
        return gap(thing, *scene.of_kind(by[1])) <= BESIDE
    between = re.fullmatch(r"between the (\w+) and the (\w+)", spot)
    if between:
        ends = [scene.of_kind(kind)[0].position[:2] for kind in between.groups()]
        return sum(math.dist((x, y), end) for end in ends) <= math.dist(*ends) + 0.04
    truths = {
        "left": y >= 0.03,
        "right": y <= -0.03,
        "back": x >= middle + 0.03,
        "front": x <= middle - 0.03,
        "close": x <= middle - 0.06,
        "middle": math.dist((x, y), (middle, 0.0)) <= 0.09,
    }
    named = [word for word in truths if word in spot.split()]
    assert named, spot
    return all(truths[word] for word in named)


@pytest.mark.parametrize("task", TASKS_WITH_PLACES)
def test_a_spot_such_as_on_the_left_is_true_of_one_object_only(task):
    """A spot is a place that can be said alone. `is_there` checks it by measures of its own."""
    kind = get_task(task).things.pointed
    for scene in scenes_of(task):
        things = candidates_in(scene, kind)
        depths = [thing.position.x for thing in things]
        middle = (min(depths) + max(depths)) / 2 if len(things) > 1 else -0.05
        for spot, thing in things_by_spot(scene, kind).items():
            fitting = [other for other in things if is_there(spot, other, scene, middle)]
            assert thing in fitting, spot
            fitting.remove(thing)
            if "far" in spot or "all the way" in spot:
                place = thing.position[:2]
                fitting = [
                    other for other in fitting if math.dist(place, other.position[:2]) < 2 * MARGIN
                ]
            assert not fitting, spot


@pytest.mark.parametrize("task", TASKS_WITH_PLACES)
def test_nearly_all_published_scenes_have_everyday_words_for_a_goal_object(task):
    """Three of five have a spot, a place that can be said without a noun: *on the left*."""
    kind = get_task(task).things.pointed
    with_spot = []
    unusual = []
    for episode in split_episodes(task):
        if find_refusal(episode, InstructionOptions("spatial")):
            continue
        request = request_of(episode, InstructionOptions("spatial"))
        things = []
        for color in request.color_values:
            things += request.objects_to_point_at(color)
        every = spoken_places(episode.scene, kind, "robot")
        places = [place for place in every if place.thing in things]
        assert places
        with_spot.append(any(place.spot for place in places))
        unusual.append(all(place.kind == PlaceClass.UNUSUAL for place in places))

    assert sum(with_spot) >= 0.6 * len(with_spot)
    assert sum(unusual) <= 0.04 * len(unusual)


@pytest.mark.parametrize(
    ("task", "index"), [("VideoUnmask", 10), ("BinFill", 34)], ids=["neighbor", "unusual"]
)
def test_an_object_with_unusual_words_only_is_refused_by_the_grounded_setting(task, index):
    """*Nearest to the one closest to you* is said by no one; the spatial setting still uses it."""
    episode = get_episode(task, "test", index)
    assert find_refusal(episode, InstructionOptions("grounded")) == NOTHING_TO_SEE

    spatial = instruct(episode, "spatial")
    assert spatial.metadata["landmark_classes"] == [PlaceClass.UNUSUAL]


FIVE_IN_A_ROW = [(0.0, y) for y in (-0.16, -0.08, 0.0, 0.08, 0.16)]
SQUARE = [(-0.15, 0.15), (-0.15, -0.15), (0.15, 0.15), (0.15, -0.15)]


def test_examples_of_everyday_words_for_a_row_and_for_a_square():
    """Container 0 of the row is the one on the robot's right; the camera sees it on its left."""
    row = scene_with_containers(FIVE_IN_A_ROW)
    assert phrases_after_a_noun(row, "container_4") == {"all the way on the left"}
    assert phrases_after_a_noun(row, "container_3") == {"second from the left"}
    assert "in the middle" in phrases_after_a_noun(row, "container_2")
    assert things_by_spot(row)["on the far right"].name == "container_0"
    assert "in the back left corner" in phrases_after_a_noun(
        scene_with_containers(SQUARE), "container_2"
    )
    assert "at the front right" in phrases_after_a_noun(
        scene_with_containers(SQUARE), "container_1"
    )

    camera = phrases_after_a_noun(row, "container_4", frame="camera")
    assert camera == {"all the way on the right of the picture"}


def test_examples_of_everyday_words_for_things_near_a_button_or_a_target():
    fixtures = (("button", (-0.2, 0.0)), ("target", (0.1, 0.0)))
    scene = scene_with_containers([(-0.05, -0.03), (-0.19, 0.09), (0.1, -0.2)], *fixtures)
    assert "between the button and the target" in phrases_after_a_noun(scene, "container_0")
    assert "right by the button" in things_by_spot(scene)
    assert {"next to the button", "to the left of the button"} <= phrases_after_a_noun(
        scene, "container_1"
    )
    assert "farthest from the button" in phrases_after_a_noun(scene, "container_2")

    behind = scene_with_containers([(-0.05, 0.04), (0.1, -0.2)], fixtures[0])
    assert "to the left of the button" not in phrases_after_a_noun(behind, "container_0")


def test_a_cube_alone_on_the_table_is_not_described_by_comparison():
    """No *leftmost cube* and no corner; and of two cubes, one is not *next to* the other."""
    for scene in (
        scene_with_cubes((0.1, 0.1)),
        scene_with_cubes((-0.08, 0.0)),
        scene_with_cubes((-0.2, 0.04)),
    ):
        places = spoken_places(scene, "cube", "robot")
        assert places
        assert not any(place.attributive for place in places)
        assert not any("corner" in place.spot for place in places)
    assert phrases_after_a_noun(
        scene_with_cubes((0.0, 0.1), (0.0, 0.0)), "cube_green", "cube"
    ).isdisjoint({"nearest to the red cube", "next to the red cube"})


def test_places_do_not_depend_on_cubes_that_arrive_later():
    """`Away` keeps the blue cube off the table for the first 100 steps."""
    scene = scene_with_cubes((0.0, 0.15), (0.0, 0.0), (0.0, -0.15))
    late = replace(scene, motions=(Away("cube_blue", 0, 100),))

    early = replace(
        scene, objects=tuple(thing for thing in scene.objects if thing.name != "cube_blue")
    )

    assert things_by_phrase(late, "cube") == things_by_phrase(early, "cube")


@pytest.mark.parametrize("task", TASKS_WITH_PLACES)
def test_a_clue_leads_to_one_object_and_never_to_one_that_it_excludes(task):
    """A clue describes an object by what can be seen, in part by what it is not."""
    kind = get_task(task).things.pointed
    for scene in scenes_of(task):
        found = {}
        for thing, clue in thing_clues(scene, get_task(task)):
            assert found.setdefault(clue.words, thing.name) == thing.name
            assert thing.name not in {
                things_at(scene, kind, "robot")[aside].name for aside in clue.aside
            }


def test_a_story_that_needs_a_spot_is_chosen_only_for_a_cube_with_a_spot():
    """The story says *The table wobbles on the left*: a place that stands without a noun."""
    (scenario,) = read_task_scenarios(WOBBLY, "mine.toml")["PickXtimes"].scenarios
    options = InstructionOptions("spatial", wordings="train")
    fitting = 0

    for index in range(40):
        request = request_of(get_episode("PickXtimes", "train", index), options)
        chosen = choose(request, "spatial", [scenario])
        (color,) = request.color_values
        things = request.objects_to_point_at(color)
        known = {
            spot
            for spot, thing in things_by_spot(request.episode.scene, "cube").items()
            if thing in things
        }
        assert bool(chosen) == bool(known)
        if chosen:
            (landmark,) = chosen.offer.notes["landmarks"]
            assert landmark in known
            fitting += 1

    assert fitting


def test_a_story_that_takes_any_place_prefers_a_spot():
    """A spot is a place that stands without a noun, *on the left*. Where a cube has none, the mark
    `{place:any}` takes words after the noun, where `{place:spot}` would not fit."""
    (scenario,) = read_task_scenarios(WOBBLY, "mine.toml")["PickXtimes"].scenarios
    text = WOBBLY.replace("The table wobbles {place:spot}", "Sand the cube {place:any}")
    (any_place,) = read_task_scenarios(text, "mine.toml")["PickXtimes"].scenarios
    options = InstructionOptions("spatial", wordings="train")
    forms = set()

    for index in range(40):
        request = request_of(get_episode("PickXtimes", "train", index), options)
        spot = choose(request, "spatial", [scenario])
        found = choose(request, "spatial", [any_place])
        assert spot is None or spot.offer == found.offer
        forms.add(found.introduced.values["place"][0].form)

    assert forms == {"spot", None}


@pytest.mark.parametrize("task", UNMASK)
def test_only_containers_that_change_places_are_said_to_have_started_somewhere(task):
    noun = "cube" if "Button" in task else "container"
    started = "that started " if task == "VideoUnmaskSwap" else ""
    for scene in scenes_of(task):
        places = {
            f"the {noun} {started}{place.attributive}": place.thing
            for place in spoken_places(scene, get_task(task).things.pointed, "robot")
        }
        for thing, clue in thing_clues(scene, get_task(task)):
            assert clue.kind == "sets" or places[clue.words] is thing


def test_a_place_at_the_start_means_a_cube_and_the_container_that_covers_it_later():
    """At first the video of VideoUnmaskSwap shows the cubes alone."""
    same = 0
    for scene in scenes_of("VideoUnmaskSwap"):
        covers = {cube.inside for cube in scene.of_kind("hidden_cube")}
        of_cubes = things_by_spot(scene, "hidden_cube")
        for spot, container in things_by_spot(scene).items():
            if container.name in covers and spot in of_cubes:
                assert of_cubes[spot].inside == container.name
                same += 1
    assert same


def test_the_phrases_of_places_by_class(snapshot):
    """The table of all phrases for places, by class: a change of words is read in the diff."""
    found = defaultdict(set)
    for task in all_tasks():
        kind = get_task(task).things.pointed
        some = itertools.islice(split_episodes(task), 0, None, 5)
        for episode, frame in itertools.product(some, FRAMES):
            for place in spoken_places(episode.scene, kind, frame):
                if place.kind < PlaceClass.UNUSUAL:
                    found[place.kind.name, frame, "after a noun"].add(place.attributive)
                    found[place.kind.name, frame, "spot"].add(place.spot)
    lines = []

    for (kind, frame, form), words in sorted(found.items()):
        if words - {None}:
            lines.append(f"{kind}, {frame}, {form}: {'; '.join(sorted(words - {None}))}")

    assert "\n".join(lines) == snapshot
