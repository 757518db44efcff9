"""The task of the recipe in docs/add-task.md: one file from outside, and it works everywhere."""

import importlib.util
import re
import sys
from dataclasses import replace
from pathlib import Path

import pytest

import roboirg
from roboirg import tasks
from roboirg.core.conditions import Fact
from roboirg.core.episode import Primitive, Stage
from roboirg.core.errors import RoboIRGError
from roboirg.judging import Judge, Status
from roboirg.policies import make_policy, play
from roboirg.tasks.splits import splits
from roboirg.tasks.splits.splits import get_episode

PAGE = (Path(__file__).parents[2] / "docs" / "add-task.md").read_text()
OUTSIDE_TASK = "PlaceAndPress"


@pytest.fixture
def task(tmp_path, monkeypatch):
    """The recipe's task, as if its package were installed."""
    code, _ = re.findall(r"```python\n(.*?)```", PAGE, flags=re.DOTALL)
    words, _ = re.findall(r"```toml\n(tasks = .*?)```", PAGE, flags=re.DOTALL)
    (tmp_path / "place_and_press.py").write_text(code)
    (tmp_path / "words.toml").write_text(words)
    spec = importlib.util.spec_from_file_location(
        "place_and_press", tmp_path / "place_and_press.py"
    )
    module = importlib.util.module_from_spec(spec)
    monkeypatch.setitem(sys.modules, "place_and_press", module)
    spec.loader.exec_module(module)
    registry = (*tasks.every_task().values(), module.TASK)
    caches = (tasks.all_tasks, tasks.all_suites)
    with monkeypatch.context() as patch:
        patch.setattr(tasks, "_registry", lambda: registry)
        for cache in caches:
            cache.cache_clear()
        yield module.TASK
    for cache in caches:
        cache.cache_clear()


def test_a_task_of_another_package_is_found_by_name_and_by_its_suite(task):
    """The task is the documentation's, "PlaceAndPress", as if its package were installed."""
    assert tasks.get_task(OUTSIDE_TASK) is task
    assert tasks.find_tasks([OUTSIDE_TASK]) == (OUTSIDE_TASK,)
    assert tasks.find_tasks([task.suite]) == (OUTSIDE_TASK,)


def test_a_task_of_another_package_is_not_part_of_all(task):
    """The fixture has registered the documentation's task, "PlaceAndPress". *All* are the tasks of
    the benchmark."""
    assert OUTSIDE_TASK not in tasks.find_tasks(["all"])


def test_a_failure_in_a_task_of_another_package_has_a_readable_cause(task):
    """The documentation's task is to place a cube and then to press the button; here it is pressed
    at the first step."""
    episode = get_episode(OUTSIDE_TASK, "test", 2)
    color = episode.goal.text("color")

    judge = Judge(episode.stages, episode.scene)

    assert judge.update(0, frozenset([Fact("pressed", "button")])) is Status.FAILURE
    assert judge.cause == f"pressed the button too early; expected: pick up the {color} cube"


@pytest.mark.sim
@pytest.mark.parametrize("policy", ["oracle", "listener"])
def test_built_in_policies_solve_a_task_of_another_package(task, policy):
    """The fixture has registered the documentation's task, as if its package were installed. The
    oracle knows the goal, and the listener understands the words."""
    env = roboirg.make(OUTSIDE_TASK, setting="contextual", episode=1, cameras=())
    assert play(env, make_policy(policy, 0))["status"] == "success"


@pytest.mark.parametrize(
    ("fact", "sentence"),
    [
        (Fact("over", "cube_red", "cube_red"), "'cube_red' is a cube, not a target"),
        (Fact("picked", "button"), "'button' is a button, not a cube or a tape"),
        (Fact("placed", "cube_red"), "it needs a place, which is a target or a site"),
        (Fact("picked", "cube_red", "target"), "picked has no place"),
        (Fact("picked", "cube_pink"), "the scene has no 'cube_pink'; it has button, "),
        (Fact("lift", "cube_red"), "There is no kind of fact 'lift'"),
    ],
)
def test_a_stage_that_expects_an_impossible_fact_is_refused(task, monkeypatch, fact, sentence):
    """A fact is a kind, a subject and perhaps a place, and a task can name wrong ones."""
    stage = Stage(fact, Primitive("pick_cube", "cube_red"), "go")
    made = replace(task, stages=lambda _scene, _goal: (stage,))
    monkeypatch.setattr(splits, "get_task", lambda _name: made)

    with pytest.raises(RoboIRGError, match=re.escape(sentence)):
        splits.make_episode(OUTSIDE_TASK, 0, "hard")
