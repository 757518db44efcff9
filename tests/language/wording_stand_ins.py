"""What tests of words share: a scenario, and a clone of RoboMME's repository for the import."""

import shutil
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import robomme_stand_in

from roboirg.apps.language_lab import robomme_import
from roboirg.core.episode import SUITES, Episode, Goal
from roboirg.language.scenarios import scenario_file
from roboirg.tasks import all_tasks, get_task
from roboirg.tasks.splits.published_episodes import published_episode

WOBBLY = """
tasks = ["PickXtimes"]
[[scenario]]
frame = "wobbly"
pool = "train"
setting = "spatial"
introduction = "The table wobbles {place:spot}."
say.color = ["the cube <there place: there>"]
"""
"""A scenario of our own, of the spatial setting."""


def take_words(monkeypatch, task: str) -> None:
    """Take our words of a task away, as if none had been written."""
    monkeypatch.setitem(all_tasks(SUITES), task, replace(get_task(task), words=""))
    read = scenario_file.task_scenarios.__wrapped__
    monkeypatch.setattr(scenario_file, "task_scenarios", read)


def make_clone(folder: Path) -> Path:
    """A folder with the stand-in in the place of RoboMME's file."""
    place = folder / robomme_import.FILE
    place.parent.mkdir(parents=True)
    shutil.copy(robomme_stand_in.__file__, place)
    return folder


def sentence(task: str, goal: Goal, difficulty: str = "hard") -> str:
    """What the stand-in says, asked without the import."""
    stand_in = robomme_import.stand_in(goal, difficulty)
    return str(robomme_stand_in.get_language_goal(stand_in, task)[0])


def train_episodes(task: str, first: int, last: int) -> Iterator[Episode]:
    """Published training episodes."""
    for index in range(first, last):
        found = published_episode(task, "train", index)
        if found is not None:
            stages = get_task(task).stages(found.scene, found.goal)
            yield Episode(
                task, "train", index, found.seed, found.difficulty, found.scene, found.goal, stages
            )


def train_goals(task: str) -> frozenset[Goal]:
    """Every goal that the published training scenes of a task allow."""
    return frozenset(
        goal
        for episode in train_episodes(task, 0, 100)
        for goal in get_task(task).goals(episode.scene)
    )
