"""Clones of RoboMME's repository, as far as an import reads them, with sentences of our own."""

import functools
import importlib.util
import shutil
from collections.abc import Iterator
from pathlib import Path

from roboirg.apps.language_lab import robomme_import
from roboirg.core.episode import Episode, Goal
from roboirg.language.instruction import Instruction
from roboirg.language.slot_types.number import SAME_NUMBER
from roboirg.tasks import get_task
from roboirg.tasks.splits.published_episodes import published_episode

STYLES = ("sentences_in_words", "sentences_in_digits")


def sentence_file(style: str) -> Path:
    """The stand-in for RoboMME's file."""
    return Path(__file__).parent / "wordings" / f"{style}.py"


def make_clone(folder: Path, style: str) -> Path:
    """A folder with the stand-in in the place of RoboMME's file."""
    place = folder / robomme_import.FILE
    place.parent.mkdir(parents=True)
    shutil.copy(sentence_file(style), place)
    return folder


@functools.cache
def sentence(style: str, task: str, goal: Goal, difficulty: str = "hard") -> str:
    """What the stand-in says, asked without the import."""
    spec = importlib.util.spec_from_file_location(style, sentence_file(style))
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    stand_in = robomme_import.stand_in(goal, difficulty)
    return str(module.get_language_goal(stand_in, task)[0])


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


def same_number(said: Instruction) -> str:
    """Our words for *that many times* that stand in a command from outside, as it noted them."""
    noted = [str(one) for one in said.metadata["templates"]]  # type: ignore[attr-defined]
    (index,) = (int(one.split("/")[1]) for one in noted if one.startswith("same number/"))
    return SAME_NUMBER.of(said.metadata["pool"])[index]  # type: ignore[arg-type]
