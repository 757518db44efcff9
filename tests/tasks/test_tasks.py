"""Invariants of every task, over the whole registry and every split."""

import itertools
import json
from collections import Counter

import numpy as np
import pytest

from roboirg.episode import DIFFICULTIES, SPLITS
from roboirg.errors import InvalidValueError, UnknownNameError
from roboirg.splits import CYCLE, SIZES, base_seed, get_episode, make_episode
from roboirg.tasks import all_tasks, geometry, get_task
from roboirg.tasks.fixtures import cube_footprint
from roboirg.tasks.placement import overlap
from roboirg.tasks.unmask import container_footprint

TASKS = tuple(all_tasks())
SETTINGS = {"explicit", "direct", "reasoning", "contextual", "spatial"}


def episodes(task: str):
    return [get_episode(task, split, index) for split in SPLITS for index in range(SIZES[split])]


def test_registry_holds_each_task_once_and_in_the_order_of_codes():
    codes = [task.code for task in all_tasks().values()]
    assert codes == sorted(set(codes))
    assert all(task.name == name for name, task in all_tasks().items())


@pytest.mark.parametrize("task", TASKS)
def test_settings_are_known_and_begin_with_explicit(task):
    settings = get_task(task).settings
    assert settings[0] == "explicit"
    assert set(settings) <= SETTINGS
    assert ("spatial" in settings) == get_task(task).spatial


@pytest.mark.parametrize("task", TASKS)
def test_difficulties_follow_the_cycle_and_seeds_the_rule(task):
    for episode in episodes(task):
        assert episode.difficulty == CYCLE[episode.index % 4]
        first = base_seed(get_task(task), episode.split) + 100 * episode.index
        assert first <= episode.seed < first + 30
    counts = Counter(episode.difficulty for episode in episodes(task) if episode.split == "test")
    assert counts == {"easy": 26, "medium": 12, "hard": 12}


@pytest.mark.parametrize("task", TASKS)
def test_seeds_are_unique_over_all_splits(task):
    seeds = [episode.seed for episode in episodes(task)]
    assert len(set(seeds)) == len(seeds)


@pytest.mark.parametrize("task", TASKS)
def test_same_seed_same_episode_other_seed_other_scene(task):
    for difficulty in DIFFICULTIES:
        first, again = (make_episode(task, 7, difficulty) for _ in range(2))
        assert first == again
        assert first.scene != make_episode(task, 8, difficulty).scene


@pytest.mark.parametrize("task", TASKS)
def test_goal_is_one_of_the_scenes_goals_and_goals_differ(task):
    for episode in episodes(task):
        goals = get_task(task).goals(episode.scene)
        assert episode.goal in goals
        assert len(set(goals)) == len(goals)


@pytest.mark.parametrize("task", TASKS)
def test_stages_speak_of_things_that_exist(task):
    for episode in episodes(task):
        names = {item.name for item in episode.scene.objects} | {"robot"}
        assert len(names) == len(episode.scene.objects) + 1
        for stage in (*episode.demonstration, *episode.stages):
            spoken = {stage.expects.subject, stage.primitive.subject}
            spoken |= {fact.subject for fact in stage.forbids}
            spoken |= {stage.expects.place, stage.primitive.place, stage.points_at} - {None}
            assert spoken <= names
            assert stage.expects not in stage.forbids
            assert ("{at}" in stage.subgoal) == (stage.points_at is not None)
        assert {motion.subject for motion in episode.motions} <= names


@pytest.mark.parametrize("task", TASKS)
def test_every_goal_has_stages(task):
    scene = make_episode(task, 3, "hard").scene
    plans = [get_task(task).stages(scene, goal) for goal in get_task(task).goals(scene)]
    assert all(plans)
    assert len(set(plans)) == len(plans)


@pytest.mark.parametrize("task", TASKS)
def test_episodes_are_plain_data(task):
    episode = get_episode(task, "test", 3)
    assert hash(episode) == hash(make_episode(task, episode.seed, "hard", "test", 3))
    numbers = [value for item in episode.scene.objects for value in (*item.position, item.yaw)]
    assert json.loads(json.dumps(numbers)) == numbers
    assert {type(value) for value in numbers} == {float}


@pytest.mark.parametrize("task", TASKS)
def test_things_on_the_table_do_not_touch(task):
    for episode in episodes(task):
        squares = [cube_footprint(cube) for cube in episode.scene.of_kind("cube")]
        squares += [container_footprint(item) for item in episode.scene.of_kind("container")]
        assert not any(overlap(*pair) for pair in itertools.combinations(squares, 2))


def test_pick_x_times_scenes_are_as_in_the_facts():
    for episode in episodes("PickXtimes"):
        cubes, (target,) = episode.scene.of_kind("cube"), episode.scene.of_kind("target")
        (button,) = episode.scene.of_kind("button")
        assert len(cubes) == (1 if episode.difficulty == "easy" else 3)
        assert len({cube.colour for cube in cubes}) == len(cubes)
        assert episode.goal.number("repeats") in (
            range(4, 6) if episode.difficulty == "hard" else range(1, 4)
        )
        assert -0.25 <= button.position.x <= -0.15
        assert -0.2 <= button.position.y <= 0.2
        assert -0.26 <= target.position.x <= 0.06
        assert -0.16 <= target.position.y <= 0.16
        for cube in cubes:
            assert -0.28 <= cube.position.x <= 0.08
            assert -0.18 <= cube.position.y <= 0.18
            assert cube.position.z == 0.02
            # 0.04 beyond the disc is free of cubes, 0.02 around a cube of the button's square.
            away = np.hypot(
                cube.position.x - target.position.x, cube.position.y - target.position.y
            )
            assert away >= 0.04 + 0.04 + geometry.CUBE_HALF
        assert len(episode.stages) == 2 * episode.goal.number("repeats") + 1
        assert not episode.demonstration
        assert not episode.motions


def test_video_unmask_scenes_are_as_in_the_facts():
    for episode in episodes("VideoUnmask"):
        containers = episode.scene.of_kind("container")
        hidden = episode.scene.of_kind("hidden_cube")
        colours = episode.goal.texts("colours")
        allowed = {"easy": {3}, "medium": {4, 5}, "hard": set(range(4, 10))}
        assert len(containers) in allowed[episode.difficulty]
        assert sorted(str(cube.colour) for cube in hidden) == ["blue", "green", "red"]
        assert [cube.inside for cube in hidden] == ["container_0", "container_1", "container_2"]
        assert colours == tuple(str(cube.colour) for cube in hidden[: len(colours)])
        assert len(colours) == (2 if episode.difficulty == "hard" else 1)
        assert len(episode.stages) == 2 * len(colours) - 1
        for container in containers:
            assert abs(container.position.x) <= 0.1725
            assert abs(container.position.y) <= 0.1725
            assert container.position.z == pytest.approx(0.052)
            assert 0 <= container.yaw <= np.pi / 2
        for first, second in itertools.combinations(containers, 2):
            gap = np.hypot(
                first.position.x - second.position.x, first.position.y - second.position.y
            )
            assert gap >= 0.0275 + 0.04 + 0.03 + 0.04
        assert {motion.subject for motion in episode.motions} == {c.name for c in containers}


def test_wrong_names_and_numbers_are_named_with_what_would_be_right():
    with pytest.raises(UnknownNameError, match=r"no task 'PickXTime'.*PickXtimes.*Did you mean"):
        get_episode("PickXTime", "test", 0)
    with pytest.raises(UnknownNameError, match=r"no split 'dev'.*train, val, test"):
        get_episode("PickXtimes", "dev", 0)
    assert get_episode("PickXtimes", "test", np.int64(3)) == get_episode("PickXtimes", "test", 3)
    for wrong in (-1, 50, 1.0, "0", True):
        with pytest.raises(InvalidValueError, match="has episodes 0 to 49"):
            get_episode("PickXtimes", "test", wrong)
