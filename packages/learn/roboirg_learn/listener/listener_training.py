"""Train a listener: the detector on labeled pictures, then the reader on instructions.

A listener understands what is said. Its detector finds objects in pictures, its reader chooses the
goal that fits words and objects. The detector learns from the train split; the reader learns also
from random scenes, whose labels stand for what the detector would find. Episodes that are held
back show how well the training goes, and nothing is learned from them.
"""

from __future__ import annotations

import random
from collections.abc import Iterable, Iterator, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import torch
from pydantic import PositiveInt

from roboirg.extension.episodes import ENVIRONMENT_VERSION, Episode, episodes_of
from roboirg.extension.sight import LabeledView
from roboirg_learn.labeled_views import draw_missing, read_views, views_at_start
from roboirg_learn.listener.detector_net import INPUT_SIZE, DetectorNet, detector_loss
from roboirg_learn.listener.encoders import ENCODERS
from roboirg_learn.listener.learned_model import LearnedModel, Without, hide_inputs
from roboirg_learn.listener.object_relations import (
    SeenObjects,
    TablePlane,
    fit_plane,
    locate_and_rank,
)
from roboirg_learn.listener.reader_plan import ReaderPlan
from roboirg_learn.listener.reader_training import (
    Lesson,
    check_reader,
    instructions_of,
    lesson_of,
    train_reader,
)
from roboirg_learn.listener.vocabulary import ListenerInput, make_vocabulary
from roboirg_learn.trainer import (
    Course,
    KeptTraining,
    Progress,
    Training,
    batch_count,
    batches,
)

DETECTOR_RATE = 1e-2
VALIDATED = 10
"""Episodes of each task's val split that are held back."""


class TrainingPlan(NamedTuple):
    """How a listener is trained.

    Attributes:
        reader: how its reader is; also its tasks and scenes, and the seed of its detector.
        detector_epochs: passes over all pictures of the train split.
        without: what it does not get.
        seeds: in a study, how many times each listener is trained; one more from seed to seed.
    """

    reader: ReaderPlan
    detector_epochs: PositiveInt = 6
    without: Without = "none"
    seeds: PositiveInt = 3

    @property
    def about(self) -> dict[str, Any]:
        """All that a listener depends on, as plain data."""
        about = dict(self.reader.about)
        about["detector_epochs"] = self.detector_epochs
        about["without"] = self.without
        return about


class SeenEpisodes(NamedTuple):
    """Scenes with what a trained detector sees of them, for any number of listeners.

    Attributes:
        episodes: those that readers learn from.
        held_back: episodes that show how training goes.
        seen: what is seen of each, by its key, without task and words.
        classes: of objects, in the order of their numbers.
        detector: that has seen them.
        plane: of the table in the pictures.
    """

    episodes: tuple[Episode, ...]
    held_back: tuple[Episode, ...]
    seen: Mapping[str, ListenerInput]
    classes: tuple[str, ...]
    detector: DetectorNet
    plane: TablePlane


class TrainingSplits(NamedTuple):
    """The episodes of a training: of the train split, random scenes, and those held back."""

    train: tuple[Episode, ...]
    random: tuple[Episode, ...]
    held_back: tuple[Episode, ...]

    @classmethod
    def of(cls, plan: ReaderPlan) -> TrainingSplits:
        """Return the episodes of a plan."""
        return cls(
            episodes_of(plan.tasks, "train"),
            episodes_of(plan.tasks, "random", plan.scenes),
            episodes_of(plan.tasks, "val", VALIDATED),
        )

    @property
    def learned(self) -> tuple[Episode, ...]:
        """The episodes that readers learn from."""
        return (*self.train, *self.random)


ViewsByKey = Mapping[str, tuple[LabeledView, ...]]
"""The labeled pictures of episodes, by the key of each."""


class LabeledEpisodes(NamedTuple):
    """All pictures of a training with their labels.

    Attributes:
        train: of the train split.
        random: of random scenes; without the pictures themselves, unless an encoder reads them.
        held_back: of the episodes that show how training goes.
    """

    train: ViewsByKey
    random: ViewsByKey
    held_back: ViewsByKey

    @property
    def by_key(self) -> ViewsByKey:
        """The views of all episodes."""
        return {**self.train, **self.random, **self.held_back}

    @property
    def classes(self) -> tuple[str, ...]:
        """The classes of all objects, in the order of their numbers."""
        found: set[str] = set()
        for view in _views_in(self.by_key):
            found.update(view.names)
        return tuple(sorted(found))


def train_listener(
    plan: TrainingPlan, folder: Path, name: str, workers: int, progress: Progress
) -> LearnedModel:
    """Train a listener on the train split and random scenes, and return it.

    Args:
        plan: how it is trained.
        folder: keeps pictures, detector and reader, which are used again as far as they fit.
        name: of the listener, among those of the folder.
        workers: processes that draw pictures; 0 uses this one.
        progress: called with a kind of work, what is done of it, and all of it.
    """
    check_reader(plan.reader)
    scenes = see_episodes(plan, folder, workers, progress)
    return train_on_scenes(scenes, plan, folder / f"reader-{name}-{plan.reader.seed}.pt", progress)


def see_episodes(
    plan: TrainingPlan, folder: Path, workers: int, progress: Progress
) -> SeenEpisodes:
    """Train a detector on the pictures of the train split, and look at all episodes.

    In random scenes, which are many, it does not look: their labels stand for what it would find.
    """
    splits = TrainingSplits.of(plan.reader)
    every_episode = (*splits.learned, *splits.held_back)
    draw_missing(folder, every_episode, views_at_start, workers, partial(progress, "pictures"))

    needs_pixels = _needs_pixels(plan)
    labeled = LabeledEpisodes(
        _read_each(folder, splits.train, pictures=True),
        _read_each(folder, splits.random, pictures=needs_pixels),
        _read_each(folder, splits.held_back, pictures=True),
    )
    plane = _plane_of(labeled)
    detector = _trained_detector(labeled, plan, folder, progress)
    seen = _see_each(labeled, detector, plane, keeps_pictures=needs_pixels)
    return SeenEpisodes(splits.learned, splits.held_back, seen, labeled.classes, detector, plane)


def _trained_detector(
    labeled: LabeledEpisodes, plan: TrainingPlan, folder: Path, progress: Progress
) -> DetectorNet:
    """Return a trained detector; a finished or interrupted training of the folder goes on."""
    course = DetectorCourse(labeled, plan)
    kept = KeptTraining(folder / f"detector-{plan.reader.seed}.pt", course.made_of)
    Training(course).run(partial(progress, "detector"), kept)
    return course.net


def _needs_pixels(plan: TrainingPlan) -> bool:
    """Return whether an encoder of the reader reads the pictures themselves."""
    return any(ENCODERS[name].reads_pixels for name in plan.reader.encoders)


def _read_each(folder: Path, episodes: Iterable[Episode], *, pictures: bool) -> ViewsByKey:
    """Return the stored views of episodes by the episode's key, with pictures or only labels."""
    return {episode.key: read_views(folder, episode, pictures=pictures) for episode in episodes}


def _views_in(views_by_key: ViewsByKey) -> list[LabeledView]:
    """Return the views of all episodes in one list."""
    found: list[LabeledView] = []
    for views in views_by_key.values():
        found += views
    return found


def _plane_of(labeled: LabeledEpisodes) -> TablePlane:
    """Return the map from places in pictures to the table, fitted to all labels."""
    views = _views_in(labeled.by_key)
    centers = np.concatenate([view.centers for view in views])
    positions = np.concatenate([view.positions for view in views])
    return fit_plane(centers / INPUT_SIZE, positions)


def _see_each(
    labeled: LabeledEpisodes, detector: DetectorNet, plane: TablePlane, *, keeps_pictures: bool
) -> dict[str, ListenerInput]:
    """Return what is seen of each episode, by its key, as inputs without task and words yet.

    Args:
        labeled: all episodes; of random scenes the labels are taken, else the detector looks.
        detector: trained.
        plane: maps pictures to the table.
        keeps_pictures: whether the pictures themselves are part of the inputs.
    """
    classes = labeled.classes
    seen = {}
    for key, views in labeled.by_key.items():
        pictures = tuple(view.picture for view in views)
        found = _as_detected(views, classes) if key in labeled.random else detector.find(pictures)
        objects = locate_and_rank(found, plane, classes)
        seen[key] = ListenerInput("", "", objects, pictures if keeps_pictures else ())
    return seen


def train_on_scenes(
    scenes: SeenEpisodes, plan: TrainingPlan, kept: Path, progress: Progress
) -> LearnedModel:
    """Train the reader of a listener on scenes that its detector has seen; return the listener.

    Args:
        scenes: episodes with what is seen of them.
        plan: how it is trained.
        kept: file in which the training is kept after each pass.
        progress: called after each pass.
    """
    reader_plan = plan.reader
    torch.manual_seed(reader_plan.seed)
    lessons = _lessons(scenes.episodes, scenes.seen, reader_plan)
    held_back = _lessons(scenes.held_back, scenes.seen, reader_plan._replace(goals=1))
    texts = (lesson.given.text for lesson in lessons)
    vocabulary = make_vocabulary(texts, scenes.classes, reader_plan.tasks)

    reader = train_reader(
        _hide_from_lessons(lessons, plan.without),
        vocabulary,
        reader_plan,
        progress,
        KeptTraining(kept, plan.about),
        _hide_from_lessons(held_back, plan.without),
    )
    return LearnedModel(vocabulary, scenes.detector, scenes.plane, reader, plan.without, plan.about)


def _lessons(
    episodes: Sequence[Episode], seen: Mapping[str, ListenerInput], plan: ReaderPlan
) -> list[Lesson]:
    """Return the lessons of episodes: each an instruction, what is seen, and the goal it means."""
    lessons = []
    for episode, text in instructions_of(episodes, plan):
        given = seen[episode.key]._replace(task=episode.task, text=text)
        lessons.append(lesson_of(given, episode))
    return lessons


def _hide_from_lessons(lessons: Iterable[Lesson], without: Without) -> list[Lesson]:
    """Return lessons without what the listener does not get: pictures, video or words."""
    return [lesson._replace(given=hide_inputs(lesson.given, without)) for lesson in lessons]


def _as_detected(views: Iterable[LabeledView], classes: Sequence[str]) -> list[SeenObjects]:
    """Return the labels of views as if the detector had found those objects.

    Args:
        views: labeled pictures.
        classes: names in the order of their numbers.
    """
    numbers = {name: number for number, name in enumerate(classes)}
    found = []
    for view in views:
        kinds = np.array([numbers[name] for name in view.names], np.int64)
        found.append(SeenObjects(kinds, view.centers / np.float32(INPUT_SIZE)))
    return found


class DetectorCourse(Course[LabeledView]):
    """A detector learns the labels of the train split."""

    net: DetectorNet
    rate = DETECTOR_RATE

    def __init__(self, labeled: LabeledEpisodes, plan: TrainingPlan) -> None:
        torch.manual_seed(plan.reader.seed)
        self._plan = plan
        self._classes = labeled.classes
        self._learned = _views_in(labeled.train)
        self._held_back = _views_in(labeled.held_back)
        self.net = DetectorNet(len(self._classes))
        self.epochs = plan.detector_epochs
        self.steps = batch_count(self._learned)

    @property
    def made_of(self) -> list[object]:
        """What must be equal for a kept training to go on; the seed is in its file's name."""
        tasks = list(self._plan.reader.tasks)
        return [tasks, list(self._classes), self.epochs, ENVIRONMENT_VERSION]

    def batches(self, epoch: int) -> Iterator[list[LabeledView]]:
        return batches(self._learned, random.Random(f"{self._plan.reader.seed}/{epoch}"))

    def loss(self, batch: Sequence[LabeledView]) -> torch.Tensor:
        return detector_loss(self.net, batch, self._classes)

    def score(self) -> dict[str, float]:
        """Return the mean loss of held-back pictures."""
        groups = batches(self._held_back, random.Random(0))
        losses = [float(self.loss(group)) for group in groups]
        return {"held back": sum(losses) / len(losses)}
