"""Scenes and scripted movements of the four Unmask tasks, over many seeds."""

import functools
import itertools
import math
from collections import Counter

import numpy as np
import pytest
from drawn_scenes import drawn_episodes

from roboirg.core.episode import DIFFICULTIES
from roboirg.core.errors import SceneRejectedError
from roboirg.core.footprints import Rectangle, Region, distance_to
from roboirg.core.motions import Away, Swap
from roboirg.tasks import get_task
from roboirg.tasks.shared import unmask, unmask_swap
from roboirg.tasks.shared.layouts import FOUR, LINE, PATTERNS, TRIANGLE, layout_points

SEEDS = range(150)
SWAP_TASKS = ("VideoUnmaskSwap", "ButtonUnmaskSwap")
STILL_TASKS = ("VideoUnmask", "ButtonUnmask")
TASKS = (*SWAP_TASKS, *STILL_TASKS)
PICKS = {
    **{(task, level): {1} for task in STILL_TASKS for level in ("easy", "medium")},
    **{(task, "hard"): {2} for task in TASKS},
    **{(task, "easy"): {1, 2} for task in SWAP_TASKS},
    **{(task, "medium"): {1} for task in SWAP_TASKS},
}
SWAPS = {"easy": {1, 2}, "medium": {1, 2}, "hard": {2, 3}}

each_task = pytest.mark.parametrize("task", TASKS)
each_swap_task = pytest.mark.parametrize("task", SWAP_TASKS)
each_difficulty = pytest.mark.parametrize("difficulty", DIFFICULTIES)


@functools.cache
def episodes(task, difficulty):
    return list(drawn_episodes(task, difficulty, SEEDS))


def containers(episode):
    return episode.scene.of_kind("container")


def swaps(episode):
    return episode.scene.motions_of(Swap)


def apart(first, second):
    return math.hypot(first.x - second.x, first.y - second.y)


@each_task
@each_difficulty
def test_the_first_three_containers_hide_cubes_and_the_goal_names_the_first(task, difficulty):
    used, numbers = Counter(), set()
    drawn = episodes(task, difficulty)
    for episode in drawn:
        hidden = episode.scene.of_kind("hidden_cube")
        assert sorted(str(cube.color) for cube in hidden) == ["blue", "green", "red"]
        assert {cube.inside for cube in hidden} == {c.name for c in containers(episode)[:3]}
        assert [cube.name for cube in hidden] == [f"cube_{cube.color}" for cube in hidden]
        used.update((cube.color, cube.inside) for cube in hidden)
        colors = episode.goal.texts("colors")
        assert colors == tuple(str(cube.color) for cube in hidden[: len(colors)])
        numbers.add(len(colors))
        assert len(get_task(task).goals(episode.scene)) == 3 + 6
        check_motions(episode, hidden)
    assert len(drawn) >= 0.95 * len(SEEDS)
    assert len(used) == 9
    assert min(used.values()) > 0.2 * len(drawn)
    assert numbers == PICKS[task, difficulty]


def check_motions(episode, hidden):
    """Containers appear at once; cubes are away during the exchanges and return under them."""
    plan = swaps(episode)
    appearing = [Away(one.name, 0, 32) for one in containers(episode)]
    away = [Away(cube.name, 64, 64 + 50 * len(plan), cube.inside) for cube in hidden]
    # Last, so that the containers have arrived in the step in which the cubes return.
    returning = away if episode.task in SWAP_TASKS else []
    assert list(episode.scene.motions) == [*appearing, *plan, *returning]
    assert not episode.scene.past


@pytest.mark.parametrize("task", STILL_TASKS)
def test_containers_that_stay_are_spread_over_the_region(task):
    # Three where five would fit best: 3 of 1000 seeds of ButtonUnmask.
    allowed = {"easy": {3}, "medium": {3, 4, 5}, "hard": set(range(3, 10))}
    for difficulty in DIFFICULTIES:
        numbers = {len(containers(episode)) for episode in episodes(task, difficulty)}
        assert numbers <= allowed[difficulty]
        assert max(numbers) >= {"easy": 3, "medium": 5, "hard": 6}[difficulty]
        for episode in episodes(task, difficulty):
            inside = [cube.inside for cube in episode.scene.of_kind("hidden_cube")]
            assert inside == ["container_0", "container_1", "container_2"]
            for one in containers(episode):
                assert max(abs(one.position.x), abs(one.position.y)) <= 0.1725
                assert np.sin(one.yaw) <= 0 <= np.cos(one.yaw)
            for first, second in itertools.combinations(containers(episode), 2):
                assert apart(first.position, second.position) >= 0.0275 + 0.04 + 0.03 + 0.04
            assert not swaps(episode)


@each_swap_task
def test_targets_are_under_any_of_the_three_containers_where_things_move(task):
    for place in range(3):
        inside = [
            episode.scene.of_kind("hidden_cube")[place].inside for episode in episodes(task, "hard")
        ]
        counts = Counter(inside)
        assert set(counts) == {"container_0", "container_1", "container_2"}
        assert min(counts.values()) > 0.25 * len(inside)


@each_swap_task
@each_difficulty
def test_containers_that_change_places_stand_apart(task, difficulty):
    usual = 3 if difficulty == "easy" else 4
    numbers = Counter(len(containers(episode)) for episode in episodes(task, difficulty))
    assert set(numbers) <= {3, usual}
    assert numbers[usual] > 0.95 * numbers.total()
    for episode in episodes(task, difficulty):
        for first, second in itertools.combinations(containers(episode), 2):
            assert apart(first.position, second.position) >= 0.0275 + 0.02 + 0.03 + 0.02


@each_task
def test_buttons_are_in_their_regions_and_free_of_containers(task):
    regions = {
        "VideoUnmask": {},
        "VideoUnmaskSwap": {},
        "ButtonUnmask": {"button": Region(-0.2, 0.0, 0.05, 0.05)},
        "ButtonUnmaskSwap": {
            "button_right": Region(-0.2, -0.1, 0.025, 0.025),
            "button_left": Region(-0.2, 0.1, 0.025, 0.025),
        },
    }[task]
    free = 0.0275 + (0.02 if task in SWAP_TASKS else 0.04)
    for episode in itertools.chain(*(episodes(task, one) for one in DIFFICULTIES)):
        buttons = episode.scene.of_kind("button")
        assert {button.name for button in buttons} == set(regions)
        for button in buttons:
            region = regions[button.name]
            assert abs(button.position.x - region.x) <= region.half_x
            assert abs(button.position.y - region.y) <= region.half_y
            # RoboMME keeps containers away from one of two buttons; none touches the other's base.
            half, gap = (0.0375, 0.0425) if button.name == "button_left" else (0.05625, free)
            square = Rectangle(button.position.x, button.position.y, half, half)
            for one in containers(episode):
                assert distance_to(square, one.position.x, one.position.y) >= gap


@pytest.mark.parametrize("count", [3, 4])
def test_layouts_are_turned_patterns(count):
    angles = []
    for seed in SEEDS:
        points = [complex(*point) for point in layout_points(np.random.default_rng(seed), count)]
        # A turn multiplies every point by the same number of length 1.
        turns = []
        for pattern in PATTERNS[count]:
            turn = points[0] / complex(*pattern[0])
            if np.allclose(points, [turn * complex(*point) for point in pattern]):
                turns.append(turn)
        assert len(turns) == 1
        assert abs(turns[0]) == pytest.approx(1.0)
        angles.append(math.atan2(turns[0].imag, turns[0].real))
    quarters, _ = np.histogram(angles, bins=4, range=(-math.pi, math.pi))
    assert quarters.min() > 0.15 * len(SEEDS)


@each_difficulty
def test_containers_of_video_unmask_swap_stand_near_their_points(difficulty):
    for episode in episodes("VideoUnmaskSwap", difficulty):
        count = 3 if difficulty == "easy" else 4
        points = layout_points(np.random.default_rng(episode.seed), count)
        for one, (x, y) in zip(containers(episode), points, strict=False):
            assert abs(one.position.x - x) <= 0.0425
            assert abs(one.position.y - y) <= 0.0425


def test_shape_and_swaps_and_picks_do_not_tell_each_other():
    found = Counter()
    for episode in episodes("VideoUnmaskSwap", "easy"):
        points = layout_points(np.random.default_rng(episode.seed), 3)
        line = min(math.hypot(*point) for point in points) < 1e-9
        found[line, len(swaps(episode)), len(episode.goal.texts("colors"))] += 1
    assert len(found) == 8
    assert min(found.values()) > 0.06 * len(SEEDS)


def test_containers_of_button_unmask_swap_stand_in_their_ranges():
    slack = 0.0425 + 1e-12
    for episode in (*episodes("ButtonUnmaskSwap", "medium"), *episodes("ButtonUnmaskSwap", "hard")):
        places = [one.position for one in containers(episode)]
        for place, (x, y) in zip(
            places, [(0, -0.1), (0, 0.1), (0.1, 0.1), (0.1, -0.1)], strict=False
        ):
            assert abs(place.x - x) <= slack
            assert -slack <= place.y - y <= 0.1 + slack
        assert abs(places[1].y - places[0].y - 0.2) <= 2 * slack
    thirds = []
    for episode in episodes("ButtonUnmaskSwap", "easy"):
        places = [one.position for one in containers(episode)]
        for place, y in zip(places, (-0.15, 0.15, 0.0), strict=True):
            assert abs(place.y - y) <= slack
        for place in places[:2]:
            assert -slack <= place.x + 0.05 <= 0.1 + slack
        thirds.append(places[2].x)
        assert -0.05 - slack <= thirds[-1] <= 0.15 + slack
    # The third is in line with the others or in front of them, each in half of the scenes.
    assert 0.35 < np.mean([x > 0.05 for x in thirds]) < 0.65


@each_swap_task
@each_difficulty
def test_swaps_follow_each_other_with_the_nearest_partner(task, difficulty):
    numbers = Counter()
    for episode in episodes(task, difficulty):
        places = {one.name: one.position for one in containers(episode)}
        plan = swaps(episode)
        numbers[len(plan)] += 1
        assert [swap.start for swap in plan] == [64, 114, 164][: len(plan)]
        for swap in plan:
            assert (swap.steps, swap.lane, swap.stage) == (50, 0.07, None)
            others = set(places) - {swap.first}
            reach = {other: apart(places[swap.first], places[other]) for other in others}
            assert reach[swap.second] == min(reach.values())
            assert set(swap.pinned) == others - {swap.second}
            places[swap.first], places[swap.second] = places[swap.second], places[swap.first]
    assert set(numbers) == SWAPS[difficulty]
    assert min(numbers.values()) > 0.4 * numbers.total()


@each_swap_task
def test_exchanges_are_begun_by_different_containers_the_first_two_with_cubes(task):
    third_is_empty = Counter()
    for episode in itertools.chain(*(episodes(task, one) for one in DIFFICULTIES)):
        begin = [swap.first for swap in swaps(episode)]
        assert len(set(begin)) == len(begin)
        assert all(episode.scene.hidden_in(name) is not None for name in begin[:2])
        if len(begin) == 3 and len(containers(episode)) == 4:
            third_is_empty[episode.scene.hidden_in(begin[2]) is None] += 1
    assert 0.35 < third_is_empty[True] / third_is_empty.total() < 0.65


def final_places(episode):
    """Where the containers are after all exchanges, told by whose place it was."""
    places = {one.name: one.name for one in containers(episode)}
    for swap in swaps(episode):
        places[swap.first], places[swap.second] = places[swap.second], places[swap.first]
    return places


@each_swap_task
def test_exchanges_may_cancel_out_only_if_there_are_two(task):
    canceled = Counter()
    for episode in itertools.chain(*(episodes(task, one) for one in DIFFICULTIES)):
        places = final_places(episode)
        assert sorted(places.values()) == sorted(places)
        canceled[len(swaps(episode)), all(one == places[one] for one in places)] += 1
    assert {number for number, same in canceled if same} == {2}
    assert {number for number, same in canceled if not same} == {1, 2, 3}


@each_swap_task
@each_difficulty
def test_where_the_cube_was_is_a_bad_guess(task, difficulty):
    moved = [
        final_places(episode)[cube.inside] != cube.inside
        for episode in episodes(task, difficulty)
        for cube in episode.scene.of_kind("hidden_cube")[:1]
    ]
    # Measured for RoboMME over about 70 seeds: 54 to 67 percent.
    assert 0.45 < np.mean(moved) < 0.75


def test_the_video_lasts_until_the_last_exchange():
    for task, steps in (
        ("VideoUnmask", {0: 64}),
        ("VideoUnmaskSwap", {1: 114, 2: 164, 3: 214}),
    ):
        for episode in itertools.chain(*(episodes(task, one) for one in DIFFICULTIES)):
            (watch,) = episode.demonstration
            assert watch.lasting == watch.primitive.steps == steps[len(swaps(episode))]
    for task in ("ButtonUnmask", "ButtonUnmaskSwap"):
        assert not any(episode.demonstration for episode in episodes(task, "hard"))


@each_task
def test_subgoals_in_order(task):
    presses = {
        "ButtonUnmask": [("press the button {at}", "button")],
        "ButtonUnmaskSwap": [
            ("press the first button {at}", "button_left"),
            ("press the second button {at}", "button_right"),
        ],
    }.get(task, [])
    for episode in episodes(task, "hard")[:30]:
        first, second = (
            (color, str(episode.scene[f"cube_{color}"].inside))
            for color in episode.goal.texts("colors")
        )
        expected = [
            *presses,
            (f"pick up the container {{at}} that hides the {first[0]} cube", first[1]),
            ("put down the container", None),
            (f"pick up the container {{at}} that hides the {second[0]} cube", second[1]),
        ]
        assert [(stage.subgoal, stage.points_at) for stage in episode.stages] == expected
        for stage, (_, button) in zip(episode.stages, presses, strict=False):
            assert stage.primitive.subject == button


def test_scenes_with_fewer_than_three_containers_are_rejected():
    rng = np.random.default_rng(0)
    placed = unmask_swap.draw_containers_about(rng, [FOUR[0], FOUR[1]])
    assert len(placed) == 2
    with pytest.raises(SceneRejectedError, match="fewer than three"):
        unmask_swap.sample(rng, "easy", placed)
    with pytest.raises(SceneRejectedError, match="fewer than three"):
        unmask.hide_cubes(rng, placed)


def test_placement_ends_at_the_first_container_that_fits_nowhere():
    # All of the second square is within the first container's clearance in every draw.
    tight = Region(0.0, 0.0, 0.03, 0.03)
    roomy = Region(0.5, 0.5, 0.1, 0.1)
    placed = unmask.draw_containers_in(np.random.default_rng(0), [tight, tight, roomy], 0.02)
    assert [one.name for one in placed] == ["container_0"]


def test_the_patterns_are_those_of_the_facts():
    assert {3: (TRIANGLE, LINE), 4: (FOUR,)} == PATTERNS
    assert TRIANGLE[:2] == FOUR[:2]
    assert FOUR == ((-0.05, -0.1), (-0.05, 0.1), (0.1, 0.1), (0.1, -0.1))
    assert TRIANGLE[2] == (0.1, 0.0)
    assert LINE == ((0.0, -0.15), (0.0, 0.15), (0.0, 0.0))
