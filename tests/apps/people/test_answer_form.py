"""The form that people fill, for every task."""

import itertools
from dataclasses import replace

import pytest
from study_fakes import all_answers

from roboirg.apps.people.answer_form import (
    FormAnswer,
    answer_form,
    answer_of,
    checked_answer,
    goal_of,
)
from roboirg.core.errors import InvalidValueError
from roboirg.evaluation.grounding_items.referents import find_candidates
from roboirg.tasks import every_task, get_task
from roboirg.tasks.splits.splits import get_episode


@pytest.mark.parametrize("task", every_task())
def test_every_goal_has_an_answer_that_means_it(task):
    for episode in (
        get_episode(task, split, one) for split in ("test", "train") for one in (0, 7, 30)
    ):
        stages = get_task(task).stages
        seen = [one.name for one in find_candidates(episode)]
        every = all_answers(episode, seen)
        assert len({one.category for one in every}) == len(every)
        meant = set()
        for goal in get_task(task).goals(episode.scene):
            answer = answer_of(episode, goal)
            assert checked_answer(episode, *answer) == answer
            assert answer in every
            assert stages(episode.scene, goal_of(episode, answer)) == stages(episode.scene, goal)
            meant.add(answer.category)
        # All other answers mean nothing that the scene has.
        others = [one for one in every if one.category not in meant]
        assert {goal_of(episode, one) for one in others} <= {None}


@pytest.mark.parametrize("task", every_task())
def test_the_form_does_not_depend_on_the_goal(task):
    episode = get_episode(task, "test", 3)
    for goal in get_task(task).goals(episode.scene):
        other = replace(episode, goal=goal)
        assert find_candidates(other) == find_candidates(episode)


def test_what_is_asked_where():
    forms = {task: answer_form(task) for task in every_task()}
    assert forms["BinFill"].kinds == ()
    assert [one.name for one in forms["BinFill"].fields] == ["red", "blue", "green"]
    assert forms["VideoUnmask"] == (("container", "container"), 1, ())
    assert forms["VideoPlaceOrder"] == (("cube", "target"), 2, ())
    assert forms["StopCube"].kinds == ()  # there is one target only
    assert [one.name for one in forms["PickXtimes"].fields] == ["repeats"]


def test_answers_that_do_not_fill_the_form_are_refused():
    pick, unmask = get_episode("PickXtimes", "test", 30), get_episode("VideoUnmask", "test", 30)
    right = {"repeats": 2}
    for episode, objects, values in (
        (pick, [], right),
        (pick, ["target"], right),
        (pick, ["cube_red", "cube_blue"], right),
        (pick, ["cube_red"], {}),
        (pick, ["cube_red"], {"repeats": 9}),
        (pick, ["cube_red"], {"repeats": "2"}),
        (pick, ["cube_red"], {"repeats": True}),
        (pick, ["cube_red"], {"repeats": [2]}),
        (unmask, ["container_0", "container_0"], {}),
        (unmask, ["container_0", "container_1", "container_2"], {}),
        (unmask, ["cube_red"], {}),
    ):
        with pytest.raises(InvalidValueError):
            checked_answer(episode, objects, values)
    assert checked_answer(pick, ["cube_red"], {**right, "more": 1}) == (("cube_red",), right)


def test_an_empty_container_and_too_many_cubes_mean_no_goal():
    unmask = get_episode("VideoUnmask", "test", 30)
    empty = next(one.name for one in unmask.scene.of_kind("container")
                 if unmask.scene.hidden_in(one.name) is None)  # fmt: skip
    assert goal_of(unmask, FormAnswer((empty,), {})) is None
    fill = get_episode("BinFill", "test", 30)
    for counts in itertools.product((0, 5), repeat=3):
        answer = FormAnswer((), dict(zip(("red", "blue", "green"), counts, strict=True)))
        assert goal_of(fill, answer) is None
