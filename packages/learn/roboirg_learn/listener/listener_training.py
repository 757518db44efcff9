"""Train a listener: the detector on labeled pictures, then the reader on instructions.

A listener understands what is said. Its detector finds objects in pictures, its reader chooses the
goal that fits words and objects. The detector learns from the train split; the reader learns also
from random scenes, whose labels stand for what the detector would find. Validation episodes show
how well the training goes, and nothing is learned from them.
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
    Example,
    check_reader,
    example_of,
    instructions_of,
    train_reader,
)
from roboirg_learn.listener.vocabulary import ListenerInput, make_vocabulary
from roboirg_learn.trainer import (
    Checkpoint,
    Course,
    Progress,
    Training,
    batch_count,
    batches,
)

DETECTOR_RATE = 1e-2
VALIDATED = 10
"""Episodes of each task's val split that are for validation."""


class TrainingPlan(NamedTuple):
    """How a listener is trained.

    Attributes:
        reader: how its reader is; also its tasks and scenes, and the seed of its detector.
        detector_epochs: passes over all pictures of the train split.
        without: what it does not get: pictures, video or words; "none" for all.
        seeds: in a study, how many times each listener is trained, with `reader.seed` and those
            after it.
    """

    reader: ReaderPlan
    detector_epochs: PositiveInt = 6
    without: Without = "none"
    seeds: PositiveInt = 3

    @property
    def about(self) -> dict[str, Any]:
        """All that a listener depends on, as plain JSON data; stands in trained files."""
        about = dict(self.reader.about)
        about["detector_epochs"] = self.detector_epochs
        about["without"] = self.without
        return about


class SeenEpisodes(NamedTuple):
    """Scenes with what a trained detector sees of them, for any number of listeners.

    Attributes:
        episodes: those that readers learn from.
        validation: episodes that show how training goes.
        seen: what is seen of each, by its key; task and words are still empty.
        classes: of objects, in the order of their numbers.
        detector: that has seen them.
        plane: of the table in the pictures.
    """

    episodes: tuple[Episode, ...]
    validation: tuple[Episode, ...]
    seen: Mapping[str, ListenerInput]
    classes: tuple[str, ...]
    detector: DetectorNet
    plane: TablePlane


class TrainingSplits(NamedTuple):
    """The episodes of a training: the train split, random scenes, and those for validation."""

    train: tuple[Episode, ...]
    random: tuple[Episode, ...]
    validation: tuple[Episode, ...]

    @classmethod
    def of(cls, plan: ReaderPlan) -> TrainingSplits:
        """Return the episodes that a plan names."""
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
        validation: of the episodes that show how training goes.
    """

    train: ViewsByKey
    random: ViewsByKey
    validation: ViewsByKey

    @property
    def by_key(self) -> ViewsByKey:
        """The views of all episodes."""
        return {**self.train, **self.random, **self.validation}

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
        workers: processes that render pictures; 0 uses this one.
        progress: called with a kind of work, what is done of it, and all of it.
    """
    check_reader(plan.reader)
    scenes = see_episodes(plan, folder, workers, progress)
    checkpoint_path = folder / f"reader-{name}-{plan.reader.seed}.pt"
    return train_on_scenes(scenes, plan, checkpoint_path, progress)


def see_episodes(
    plan: TrainingPlan, folder: Path, workers: int, progress: Progress
) -> SeenEpisodes:
    """Train a detector on the pictures of the train split, and let it find the objects of episodes.

    It does not look at random scenes, which are many: their labels stand for what it would find.

    Args:
        plan: tasks, scenes, epochs and seed.
        folder: keeps pictures and detector.
        workers: processes that render pictures; 0 uses this one.
        progress: called with a kind of work, what is done of it, and all of it.
    """
    splits = TrainingSplits.of(plan.reader)
    every_episode = (*splits.learned, *splits.validation)
    draw_missing(folder, every_episode, views_at_start, workers, partial(progress, "pictures"))

    needs_pixels = _needs_pixels(plan)
    labeled = LabeledEpisodes(
        _read_each(folder, splits.train, pictures=True),
        _read_each(folder, splits.random, pictures=needs_pixels),
        _read_each(folder, splits.validation, pictures=True),
    )
    plane = _plane_of(labeled)
    detector = _trained_detector(labeled, plan, folder, progress)
    seen = _see_each(labeled, detector, plane, keeps_pictures=needs_pixels)
    return SeenEpisodes(splits.learned, splits.validation, seen, labeled.classes, detector, plane)


def _trained_detector(
    labeled: LabeledEpisodes, plan: TrainingPlan, folder: Path, progress: Progress
) -> DetectorNet:
    """Return a trained detector; a finished or interrupted training of the folder goes on."""
    course = DetectorCourse(labeled, plan)
    checkpoint = Checkpoint(folder / f"detector-{plan.reader.seed}.pt", course.made_of)
    Training(course).run(partial(progress, "detector"), checkpoint)
    return course.net


def _needs_pixels(plan: TrainingPlan) -> bool:
    """Return whether an encoder of the reader reads the pictures themselves."""
    return any(ENCODERS[name].reads_pixels for name in plan.reader.encoders)


def _read_each(folder: Path, episodes: Iterable[Episode], *, pictures: bool) -> ViewsByKey:
    """Return the stored views of episodes by the episode's key, with pictures or labels alone."""
    return {episode.key: read_views(folder, episode, pictures=pictures) for episode in episodes}


def _views_in(views_by_key: ViewsByKey) -> list[LabeledView]:
    """Return the views of all episodes in one list."""
    found: list[LabeledView] = []
    for views in views_by_key.values():
        found += views
    return found


def _plane_of(labeled: LabeledEpisodes) -> TablePlane:
    """Return the map from points of pictures to the table, fitted to all labels."""
    views = _views_in(labeled.by_key)
    centers = np.concatenate([view.centers for view in views])
    positions = np.concatenate([view.positions for view in views])
    return fit_plane(centers / INPUT_SIZE, positions)


def _see_each(
    labeled: LabeledEpisodes, detector: DetectorNet, plane: TablePlane, *, keeps_pictures: bool
) -> dict[str, ListenerInput]:
    """Return what is seen of each episode, by its key; task and words are still empty.

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
        if key in labeled.random:
            found = _as_detected(views, classes)
        else:
            found = detector.find(pictures)
        objects = locate_and_rank(found, plane, classes)
        seen[key] = ListenerInput("", "", objects, pictures if keeps_pictures else ())
    return seen


def train_on_scenes(
    scenes: SeenEpisodes, plan: TrainingPlan, checkpoint_path: Path, progress: Progress
) -> LearnedModel:
    """Train the reader of a listener on scenes that its detector has seen; return the listener.

    Args:
        scenes: episodes with what is seen of them.
        plan: how it is trained.
        checkpoint_path: file of the training's checkpoint.
        progress: called after each epoch.
    """
    reader_plan = plan.reader
    torch.manual_seed(reader_plan.seed)
    examples = _examples(scenes.episodes, scenes.seen, reader_plan)
    validation = _examples(scenes.validation, scenes.seen, reader_plan._replace(goals=1))
    texts = (example.given.text for example in examples)
    vocabulary = make_vocabulary(texts, scenes.classes, reader_plan.tasks)

    reader = train_reader(
        _hide_from_examples(examples, plan.without),
        vocabulary,
        reader_plan,
        progress,
        Checkpoint(checkpoint_path, plan.about),
        _hide_from_examples(validation, plan.without),
    )
    return LearnedModel(vocabulary, scenes.detector, scenes.plane, reader, plan.without, plan.about)


def _examples(
    episodes: Sequence[Episode], seen: Mapping[str, ListenerInput], plan: ReaderPlan
) -> list[Example]:
    """Return the examples of episodes: instructions, each with what is seen and its goal.

    Args:
        episodes: of which instructions are spoken.
        seen: what is seen of each, by its key.
        plan: settings, pool of words, and goals of each scene.
    """
    examples = []
    for episode, text in instructions_of(episodes, plan):
        given = seen[episode.key]._replace(task=episode.task, text=text)
        examples.append(example_of(given, episode))
    return examples


def _hide_from_examples(examples: Iterable[Example], without: Without) -> list[Example]:
    """Return examples without what the listener does not get: pictures, video or words."""
    return [example._replace(given=hide_inputs(example.given, without)) for example in examples]


def _as_detected(views: Iterable[LabeledView], class_names: Sequence[str]) -> list[SeenObjects]:
    """Return the labels of views as if the detector had found those objects.

    Args:
        views: labeled pictures.
        class_names: in the order of their numbers.
    """
    numbers = {name: number for number, name in enumerate(class_names)}
    found = []
    for view in views:
        classes = np.array([numbers[name] for name in view.names], np.int64)
        found.append(SeenObjects(classes, view.centers / np.float32(INPUT_SIZE)))
    return found


class DetectorCourse(Course[LabeledView]):
    """A detector learns the labels of the train split.

    Args:
        labeled: labeled pictures, of the train split to learn from and of others to validate.
        plan: epochs, and the seed of weights and batches.
    """

    net: DetectorNet
    learning_rate = DETECTOR_RATE

    def __init__(self, labeled: LabeledEpisodes, plan: TrainingPlan) -> None:
        """Collect the pictures and make an untrained network, the same for each seed."""
        self._plan = plan
        self._classes = labeled.classes
        self._learned = _views_in(labeled.train)
        self._validation = _views_in(labeled.validation)
        # The network draws its weights when it is made, so the seed must be set before.
        torch.manual_seed(plan.reader.seed)
        self.net = DetectorNet(len(self._classes))
        self.epochs = plan.detector_epochs
        self.steps_per_epoch = batch_count(self._learned)

    @property
    def made_of(self) -> list[object]:
        """What must be equal for a checkpoint to be used; the seed is in its file's name."""
        tasks = list(self._plan.reader.tasks)
        return [tasks, list(self._classes), self.epochs, ENVIRONMENT_VERSION]

    def batches(self, epoch: int) -> Iterator[list[LabeledView]]:
        """Return all labeled pictures of the train split in random batches."""
        return batches(self._learned, random.Random(f"{self._plan.reader.seed}/{epoch}"))

    def loss(self, batch: Sequence[LabeledView]) -> torch.Tensor:
        """Return `detector_loss` of a batch."""
        return detector_loss(self.net, batch, self._classes)

    def score(self) -> dict[str, float]:
        """Return the mean loss of validation pictures."""
        groups = batches(self._validation, random.Random(0))
        losses = [float(self.loss(group)) for group in groups]
        return {"held back": sum(losses) / len(losses)}
