"""A clone of RoboMME's repository, as far as an import reads it, with sentences of our own."""

import shutil
from collections.abc import Iterator
from pathlib import Path

import robomme_stand_in

from roboirg.apps.language_lab import robomme_import
from roboirg.core.episode import Episode, Goal
from roboirg.tasks import get_task
from roboirg.tasks.splits.published_episodes import published_episode


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
        goal for one in train_episodes(task, 0, 100) for goal in get_task(task).goals(one.scene)
    )
