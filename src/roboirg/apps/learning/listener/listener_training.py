"""Train a listener: the detector on labeled pictures, then the reader on instructions."""

from __future__ import annotations

import random
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
import torch
from pydantic import NonNegativeInt, PositiveInt

from roboirg.apps.learning.labeled_views import LabeledView, look
from roboirg.apps.learning.listener.detector_net import SIZE, DetectorNet, detector_loss
from roboirg.apps.learning.listener.learned_model import LearnedModel, Without, hide
from roboirg.apps.learning.listener.listener_net import (
    ListenerInput,
    make_vocabulary,
)
from roboirg.apps.learning.listener.object_relations import (
    ObjectsInView,
    SeenObjects,
    TablePlane,
    fit_plane,
    relate,
)
from roboirg.apps.learning.listener.reader_training import lesson_of, said, train_reader
from roboirg.apps.learning.trainer import Progress, Trainer, batch_count, batches
from roboirg.core.episode import Episode, Split
from roboirg.core.errors import InvalidValueError
from roboirg.core.word_pools import PoolName
from roboirg.language import LANGUAGE_VERSION
from roboirg.language.settings import settings_of
from roboirg.tasks import get_task
from roboirg.tasks.splits.splits import SIZES, get_episode
from roboirg.util.parallel_map import parallel_map

TRAINING_SPLIT: Split = "train"
DETECTOR_RATE = 1e-2

_NO_PICTURE = np.zeros((0, 0, 3), np.uint8)


class TrainingPlan(NamedTuple):
    """How a listener is trained.

    Attributes:
        tasks: names of tasks.
        settings: names of settings whose instructions it hears, harder ones where they can
            express the episode.
        words: the pool of words.
        scenes: random scenes of each task beyond the train split.
        goals: goals of each scene with an instruction by place, where there is the most to learn.
            In other settings only the episode's own is.
        detector_epochs: passes over all pictures of the train split.
        reader_epochs: passes over all instructions.
        without: what it does not get.
        seed: of initial weights and order.
    """

    tasks: tuple[str, ...]
    settings: tuple[str, ...]
    words: PoolName = "train"
    scenes: NonNegativeInt = 300
    goals: PositiveInt = 4
    detector_epochs: PositiveInt = 6
    reader_epochs: PositiveInt = 12
    without: Without = "none"
    seed: int = 0


class SeenEpisodes(NamedTuple):
    """Scenes with what a trained detector sees of them, for any number of listeners.

    Attributes:
        episodes: all of them.
        seen: the objects, by the episode's key.
        classes: of objects, in the order of their numbers.
        detector: finds objects.
        plane: of the table.
    """

    episodes: tuple[Episode, ...]
    seen: Mapping[str, ObjectsInView]
    classes: tuple[str, ...]
    detector: DetectorNet
    plane: TablePlane


def train_listener(plan: TrainingPlan, workers: int, progress: Progress) -> LearnedModel:
    """Return a listener that has learned from the train split and random scenes.

    Args:
        plan: how.
        workers: processes that draw pictures; 0 uses this one.
        progress: called with a kind of work, what is done of it, and all of it.
    """
    check_settings(plan)
    return teach(see_episodes(plan, workers, progress), plan, progress)


def check_settings(plan: TrainingPlan) -> None:
    """Raise unless some task has one of the settings.

    Raises:
        InvalidValueError: none has.
    """
    if not any(set(plan.settings) & set(settings_of(get_task(task))) for task in plan.tasks):
        raise InvalidValueError(f"None of these tasks has the setting {', '.join(plan.settings)}.")


def see_episodes(plan: TrainingPlan, workers: int, progress: Progress) -> SeenEpisodes:
    """Train a detector on the pictures of the train split, and look at all episodes.

    Of random scenes only the labels are kept: they stand for what the detector would find.

    Args:
        plan: which tasks, how many scenes and passes.
        workers: processes that draw pictures; 0 uses this one.
        progress: called with a kind of work, what is done of it, and all of it.
    """
    torch.manual_seed(plan.seed)
    episodes = tuple(_episodes(plan))
    views: dict[str, tuple[LabeledView, ...]] = {}
    for episode, own in parallel_map(_look, episodes, workers):
        views[episode.key] = own
        progress("pictures", len(views), len(episodes))
    every = [view for episode in episodes for view in views[episode.key]]
    classes = tuple(sorted({name for view in every for name in view.names}))
    plane = fit_plane(
        np.concatenate([view.centers for view in every]) / SIZE,
        np.concatenate([view.positions for view in every]),
    )
    detector = _train_detector([one for one in every if one.picture.size], classes, plan, progress)
    seen = {
        key: relate(_seen(own, detector, classes), plane, classes) for key, own in views.items()
    }
    return SeenEpisodes(episodes, seen, classes, detector, plane)


def teach(scenes: SeenEpisodes, plan: TrainingPlan, progress: Progress) -> LearnedModel:
    """Return a listener that has learned to read the instructions of scenes.

    Args:
        scenes: seen before.
        plan: which settings and words, how many passes, and what it does not get.
        progress: called with a kind of work, what is done of it, and all of it.
    """
    torch.manual_seed(plan.seed)
    spoken = said(scenes.episodes, plan.settings, plan.words, plan.goals, plan.seed)
    told = [(episode, instruction.text) for episode, instruction in spoken]
    vocabulary = make_vocabulary((text for _, text in told), scenes.classes, plan.tasks)
    lessons = [
        lesson_of(
            hide(ListenerInput(episode.task, text, scenes.seen[episode.key]), plan.without), episode
        )
        for episode, text in told
    ]
    reader = train_reader(lessons, vocabulary, plan.reader_epochs, plan.seed, progress)
    about: dict[str, Any] = {**plan._asdict(), "language_version": LANGUAGE_VERSION}
    about |= {"tasks": list(plan.tasks), "settings": list(plan.settings)}
    return LearnedModel(vocabulary, scenes.detector, scenes.plane, reader, plan.without, about)


def _look(episode: Episode) -> tuple[LabeledView, ...]:
    """Return the labeled pictures of an episode; of a random scene only the labels."""
    views = look(episode)
    if episode.split == TRAINING_SPLIT:
        return views
    return tuple(view._replace(picture=_NO_PICTURE) for view in views)


def _seen(
    views: Sequence[LabeledView], detector: DetectorNet, classes: Sequence[str]
) -> list[SeenObjects]:
    if all(view.picture.size for view in views):
        found: list[SeenObjects] = detector.find([view.picture for view in views])
        return found
    numbers = {name: number for number, name in enumerate(classes)}
    return [
        SeenObjects(
            np.array([numbers[name] for name in view.names], np.int64),
            view.centers / np.float32(SIZE),
        )
        for view in views
    ]


def _train_detector(
    shown: Sequence[LabeledView], classes: Sequence[str], plan: TrainingPlan, progress: Progress
) -> DetectorNet:
    detector, rng = DetectorNet(len(classes)), random.Random(plan.seed)
    epochs = plan.detector_epochs
    trainer = Trainer[LabeledView](
        detector,
        lambda batch: detector_loss(detector, batch, classes),
        DETECTOR_RATE,
        epochs * batch_count(shown),
    )
    for epoch in range(epochs):
        trainer.run(batches(shown, rng))
        progress("detector", epoch + 1, epochs)
    detector.eval()
    return detector


def _episodes(plan: TrainingPlan) -> Iterator[Episode]:
    for task in plan.tasks:
        yield from (
            get_episode(task, TRAINING_SPLIT, place) for place in range(SIZES[TRAINING_SPLIT])
        )
        yield from (get_episode(task, "random", place) for place in range(plan.scenes))
