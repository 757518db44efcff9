"""Scenes, videos and plans of the three Reference tasks, against the facts."""

import functools
import itertools
import math
from collections import Counter

import numpy as np
import pytest
from drawn_scenes import drawn_scenes

from roboirg.core.conditions import Fact
from roboirg.core.episode import DIFFICULTIES, Goal
from roboirg.core.errors import SceneRejectedError
from roboirg.core.footprints import Circle, overlap
from roboirg.core.motions import Swap
from roboirg.tasks.shared.fixtures import button_keep_out, cube_obstacle, footprint
from roboirg.tasks.shared.swapping import nearest
from roboirg.tasks.video_place_button import TASK as VIDEO_PLACE_BUTTON
from roboirg.tasks.video_place_order import TASK as VIDEO_PLACE_ORDER
from roboirg.tasks.video_repick import TASK as VIDEO_REPICK

TASKS = (VIDEO_REPICK, VIDEO_PLACE_BUTTON, VIDEO_PLACE_ORDER)
PLACE_TASKS = (VIDEO_PLACE_BUTTON, VIDEO_PLACE_ORDER)
SEEDS = 120

every_task = pytest.mark.parametrize("task", TASKS, ids=lambda task: task.name)
every_place_task = pytest.mark.parametrize("task", PLACE_TASKS, ids=lambda task: task.name)
every_difficulty = pytest.mark.parametrize("difficulty", DIFFICULTIES)


@functools.cache
def drawn(task, difficulty):
    """Scene and goal of the first seeds that give one."""
    return tuple(itertools.islice(drawn_scenes(task.name, difficulty), SEEDS))


def scenes(task, difficulty):
    return [scene for scene, _ in drawn(task, difficulty)]


def between(first, second):
    return math.hypot(first.position.x - second.position.x, first.position.y - second.position.y)


def shown(stages):
    """Each stage's primitive in short, with its place if it has one."""
    return [
        (kind, subject) if place is None else (kind, subject, place)
        for kind, subject, place, *_ in (stage.primitive for stage in stages)
    ]


@every_task
@every_difficulty
def test_cubes_touch_nothing_and_keep_clear_of_the_button(task, difficulty):
    for scene in scenes(task, difficulty):
        cubes, (button,) = scene.of_kind("cube"), scene.of_kind("button")
        squares = [footprint(cube) for cube in cubes]
        for number, square in enumerate(squares):
            wide = square.grown(0.02 - 1e-9)
            assert not overlap(wide, button_keep_out(button))
            assert not any(overlap(square, earlier) for earlier in squares[:number])
            assert not any(overlap(wide, cube_obstacle(cube)) for cube in cubes[:number])


@every_task
@every_difficulty
def test_videos_forbid_nothing_and_show_what_the_past_says(task, difficulty):
    for scene in scenes(task, difficulty):
        stages = task.demonstration(scene)
        assert not any(stage.forbids for stage in stages)
        assert [stage.in_video for stage in stages] == [True] * (len(stages) - 1) + [False]
        assert stages[-1].expects == Fact("home", "robot")
        expected = iter(stage.expects for stage in stages)
        assert all(fact in expected for fact in scene.past)
        for stage in (*stages, *task.stages(scene, task.goals(scene)[0])):
            assert ("{at}" in stage.subgoal) == (stage.points_at is not None)
            if stage.expects.kind == "still":
                assert stage.lasting == stage.primitive.steps > 0
                assert stage.subgoal == "static"


# VideoRepick


@every_difficulty
def test_repick_scenes(difficulty):
    for scene in scenes(VIDEO_REPICK, difficulty):
        cubes, (button,) = scene.of_kind("cube"), scene.of_kind("button")
        assert len(scene.objects) == len(cubes) + 1
        assert abs(button.position.x + 0.2) <= 0.05
        assert abs(button.position.y) <= 0.05
        colors = Counter(cube.color for cube in cubes)
        assert all(cube.name.startswith(f"cube_{cube.color}_") for cube in cubes)
        if difficulty == "hard":
            assert colors == {"red": 5, "green": 5, "blue": 5}
            for cube in cubes:
                assert -0.28 <= cube.position.x <= 0.08
                assert -0.23 <= cube.position.y <= 0.23
        else:
            assert list(colors.values()) == [3]
            # A corner of the outermost layout point's square: 0.15 + sqrt(2) * 0.05.
            assert all(math.hypot(*cube.position[:2]) <= 0.2208 for cube in cubes)
        target = scene.past[0].subject
        assert scene[target].kind == "cube"
        assert scene.past == (Fact("picked", target), Fact("lying", target))


@pytest.mark.parametrize("difficulty", ["easy", "medium"])
def test_repick_swaps_begin_with_the_shown_cube_and_go_to_the_nearest(difficulty):
    for scene in scenes(VIDEO_REPICK, difficulty):
        cubes = [cube.name for cube in scene.of_kind("cube")]
        places = {name: scene[name].position for name in cubes}
        initiators = [swap.first for swap in scene.motions]
        assert initiators[0] == scene.past[0].subject
        assert len(set(initiators)) == len(initiators)
        for number, swap in enumerate(scene.motions):
            assert (swap.start, swap.steps, swap.lane) == (1 + 50 * number, 50, 0.07)
            assert swap.second == nearest(places, swap.first)
            assert {swap.first, swap.second, *swap.pinned} == set(cubes)
            places[swap.first], places[swap.second] = places[swap.second], places[swap.first]
            first_hold = VIDEO_REPICK.demonstration(scene)[swap.stage]
            assert first_hold.primitive.kind == "hold"
            before = VIDEO_REPICK.demonstration(scene)[swap.stage - 1]
            assert before.primitive.kind == "retreat"


@every_difficulty
def test_repick_video(difficulty):
    for scene in scenes(VIDEO_REPICK, difficulty):
        target = scene.past[0].subject
        swaps = len(scene.motions)
        stages = VIDEO_REPICK.demonstration(scene)
        waiting = [("retreat", "robot")] + [("hold", "robot")] * swaps if swaps else []
        assert shown(stages) == [
            ("pick_cube", target),
            ("put_down", target),
            *waiting,
            ("go_home", "robot"),
        ]
        assert stages[1].primitive.height == 0.03
        assert [stage.lasting for stage in stages[2:-1]] == ([20] + [50] * swaps if swaps else [])


def test_repick_plan():
    scene, _ = drawn(VIDEO_REPICK, "hard")[0]
    target = scene.past[0].subject
    stages = VIDEO_REPICK.stages(scene, Goal.of(repeats=2))
    cycle = [("pick_cube", target), ("put_down", target)]
    assert shown(stages) == [*cycle, *cycle, ("press", "button")]
    assert [stage.primitive.height for stage in stages[1:4:2]] == [0.01, 0.01]
    assert [stage.timer for stage in stages] == ["pick", "put down", "pick", "put down", None]
    assert [stage.subgoal for stage in stages] == [
        "pick up the correct cube {at} for the first time",
        "put it down",
        "pick up the correct cube {at} for the second time",
        "put it down",
        "press the button {at} to finish",
    ]


# VideoPlaceButton and VideoPlaceOrder


@every_place_task
@every_difficulty
def test_place_scenes(task, difficulty):
    radius, spread = {"VideoPlaceButton": (0.06, 0.04), "VideoPlaceOrder": (0.1, 0.0)}[task.name]
    discs = 3 if (task.name, difficulty) == ("VideoPlaceButton", "easy") else 4
    for scene in scenes(task, difficulty):
        (site,), (button,) = scene.of_kind("site"), scene.of_kind("button")
        cubes, targets = scene.of_kind("cube"), scene.of_kind("target")
        assert [item.name for item in targets] == [f"target_{n}" for n in range(discs)]
        assert len(cubes) == (1 if difficulty == "easy" else 3)
        assert len({cube.color for cube in cubes}) == len(cubes)
        assert all(cube.name == f"cube_{cube.color}" for cube in cubes)
        assert site.radius == radius
        assert site.position.z == 0.005
        assert abs(site.position.x + 0.1) <= spread + 1e-9
        assert abs(site.position.y) <= spread + 1e-9
        assert abs(button.position.x - 0.1) <= 0.025
        assert abs(button.position.y) <= 0.15
        assert all(max(map(abs, cube.position[:2])) <= 0.18 for cube in cubes)
        assert all(max(map(abs, disc.position[:2])) <= 0.16 for disc in targets)


@every_place_task
@every_difficulty
def test_place_discs_and_site_keep_their_distances(task, difficulty):
    for scene in scenes(task, difficulty):
        (site,), (button,) = scene.of_kind("site"), scene.of_kind("button")
        cubes = [cube_obstacle(cube) for cube in scene.of_kind("cube")]
        for disc in scene.of_kind("target"):
            area = Circle(disc.position.x, disc.position.y, 0.06)
            assert not any(overlap(area, cube) for cube in cubes)
            assert not overlap(area, button_keep_out(button))
            assert between(disc, site) >= site.radius + 0.06
        for pair in itertools.combinations(scene.of_kind("target"), 2):
            assert between(*pair) >= 0.1


@every_place_task
def test_place_shows_the_cube_of_the_goal(task):
    for scene, goal in drawn(task, "medium"):
        placed = [fact for fact in scene.past if fact.kind == "placed"]
        assert {fact.subject for fact in placed} == {f"cube_{goal.text('color')}"}


@every_place_task
@every_difficulty
def test_place_swaps_two_drawn_discs_in_the_last_hold(task, difficulty):
    pairs = set()
    for scene in scenes(task, difficulty):
        assert len(scene.motions) == (1 if difficulty == "hard" else 0)
        for swap in scene.motions:
            assert isinstance(swap, Swap)
            discs = {disc.name for disc in scene.of_kind("target")}
            assert {swap.first, swap.second, *swap.pinned} == discs
            assert len(swap.pinned) == len(discs) - 2
            assert (swap.start, swap.steps, swap.lane) == (1, 50, 0.1)
            stage = task.demonstration(scene)[swap.stage]
            assert (stage.primitive.kind, stage.lasting) == ("hold", 60)
            pairs.add((swap.first, swap.second))
    assert len(pairs) == (12 if difficulty == "hard" else 0)


@every_difficulty
def test_place_button_video(difficulty):
    for scene in scenes(VIDEO_PLACE_BUTTON, difficulty):
        cube = scene.past[0].subject
        assert scene.past == (
            Fact("placed", cube, "target_0"),
            Fact("pressed", "button"),
            Fact("placed", cube, "target_1"),
        )
        stages = VIDEO_PLACE_BUTTON.demonstration(scene)
        pick = ("pick_cube", cube)
        assert shown(stages) == [
            *(pick, ("place_on", cube, "target_0"), ("press", "button")),
            *(pick, ("place_on", cube, "target_1"), pick, ("place_on", cube, "site")),
            *(("retreat", "robot"), ("hold", "robot"), ("go_home", "robot")),
        ]
        assert stages[6].expects == Fact("placed", cube, "site")
        assert stages[6].subgoal == "drop the cube onto table"
        assert [stage.lasting for stage in stages[7:9]] == [20, 60]


def test_place_button_goals():
    scene, _ = drawn(VIDEO_PLACE_BUTTON, "hard")[0]
    goals = VIDEO_PLACE_BUTTON.goals(scene)
    assert len(goals) == 6
    for one in goals:
        cube = f"cube_{one.text('color')}"
        answer = {"before": "target_0", "after": "target_1"}[one.text("relation")]
        stages = VIDEO_PLACE_BUTTON.stages(scene, one)
        assert shown(stages) == [("pick_cube", cube), ("place_on", cube, answer)]


@every_difficulty
def test_place_order_video(difficulty):
    for scene in scenes(VIDEO_PLACE_ORDER, difficulty):
        stages = VIDEO_PLACE_ORDER.demonstration(scene)
        visits = [fact for fact in scene.past if fact.kind == "placed"]
        assert len({fact.place for fact in visits}) == len(visits)
        assert len(scene.past) == len(visits) + 1
        assert scene.past[0].kind == "placed"
        assert len(stages) == 2 * len(visits) + 6
        cube = visits[0].subject
        expected = []
        for fact in scene.past:
            if fact.kind == "pressed":
                expected.append(("press", "button"))
            else:
                expected += [("pick_cube", cube), ("place_on", cube, fact.place)]
        expected += [("pick_cube", cube), ("place_on", cube, "site")]
        expected += [("retreat", "robot"), ("hold", "robot"), ("go_home", "robot")]
        assert shown(stages) == expected


@every_place_task
def test_crowded_seeds_are_rejected(task):
    def rejected(seed):
        try:
            task.sample(np.random.default_rng(seed), "medium")
        except SceneRejectedError as error:
            return str(error).startswith("no place for target_")
        return False

    # About 35 and 75 of 100: few enough for the 30 seeds that an episode may try.
    assert 4 <= sum(map(rejected, range(40))) <= 35
