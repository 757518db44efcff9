"""Train a listener: the detector on labeled pictures, then the reader on instructions."""

from __future__ import annotations

import random
from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import torch
from pydantic import NonNegativeInt, PositiveInt

from roboirg.extension.episodes import (
    ENVIRONMENT_VERSION,
    Episode,
    episodes_of,
    language_label,
)
from roboirg.extension.sight import LabeledView
from roboirg_learn.labeled_views import draw_missing, look, read_views
from roboirg_learn.listener.detector_net import SIZE, DetectorNet, detector_loss
from roboirg_learn.listener.encoders import ENCODERS
from roboirg_learn.listener.learned_model import LearnedModel, Without, hide
from roboirg_learn.listener.object_relations import (
    SeenObjects,
    TablePlane,
    fit_plane,
    relate,
)
from roboirg_learn.listener.reader_training import (
    check_reader,
    lesson_of,
    said,
    train_reader,
)
from roboirg_learn.listener.vocabulary import (
    USUAL_ENCODERS,
    ListenerInput,
    WordPool,
    make_vocabulary,
)
from roboirg_learn.trainer import KeptTraining, Progress, Trainer, batch_count, batches

RANDOM = "random"
"""The split of which labels stand for what a detector would find."""
DETECTOR_RATE = 1e-2
VALIDATED = 10
"""Episodes of each task's val split that show how training goes."""


class TrainingPlan(NamedTuple):
    """How a listener is trained.

    Attributes:
        tasks: names of tasks.
        settings: names of settings whose instructions it hears, harder ones where they can
            express the episode.
        language: version of the words.
        words: the pool of words.
        scenes: random scenes of each task beyond the train split.
        goals: goals of each scene with an implicit instruction.
            In other settings only the episode's own is.
        detector_epochs: passes over all pictures of the train split.
        reader_epochs: passes over all instructions.
        without: what it does not get.
        seed: of initial weights and order.
        seeds: in a study, how many times each listener is trained; one more from seed to seed.
        encoders: the settings of each encoder of the reader.
    """

    tasks: tuple[str, ...]
    settings: tuple[str, ...]
    language: int
    words: WordPool = "train"
    scenes: NonNegativeInt = 300
    goals: PositiveInt = 4
    detector_epochs: PositiveInt = 6
    reader_epochs: PositiveInt = 6
    without: Without = "none"
    seed: NonNegativeInt = 0
    seeds: PositiveInt = 3
    encoders: Mapping[str, dict[str, Any]] = USUAL_ENCODERS

    @property
    def about(self) -> dict[str, Any]:
        """All that a listener depends on, as plain data."""
        about = self._asdict() | {"tasks": list(self.tasks), "settings": list(self.settings)}
        del about["seeds"], about["language"]
        about["language_version"] = language_label(
            self.tasks, self.words, self.language, self.settings
        )
        about["environment_version"] = ENVIRONMENT_VERSION
        return about


class SeenEpisodes(NamedTuple):
    """Scenes with what a trained detector sees of them, for any number of listeners.

    Attributes:
        held_back: episodes that show how training goes.
        seen: what is seen of each, by its key, without task and words.
        classes: of objects, in the order of their numbers.
    """

    episodes: tuple[Episode, ...]
    held_back: tuple[Episode, ...]
    seen: Mapping[str, ListenerInput]
    classes: tuple[str, ...]
    detector: DetectorNet
    plane: TablePlane


def train_listener(
    plan: TrainingPlan, folder: Path, name: str, workers: int, progress: Progress
) -> LearnedModel:
    """Return a listener that has learned from the train split and random scenes.

    Pictures, the detector and the reader on the way stay in the folder, and are used again as far
    as they fit. The name is the listener's among those of the folder.
    """
    check_reader(plan.tasks, plan.settings, plan.encoders, plan.language)
    scenes = see_episodes(plan, folder, workers, progress)
    return teach(scenes, plan, folder / f"reader-{name}-{plan.seed}.pt", progress)


def see_episodes(
    plan: TrainingPlan, folder: Path, workers: int, progress: Progress
) -> SeenEpisodes:
    """Train a detector on the pictures of the train split, and look at all episodes.

    Of random scenes the labels stand for what the detector would find.
    """
    episodes = (
        *episodes_of(plan.tasks, "train"),
        *episodes_of(plan.tasks, "random", plan.scenes),
    )
    held_back = episodes_of(plan.tasks, "val", VALIDATED)
    every = (*episodes, *held_back)
    draw_missing(folder, every, look, workers, partial(progress, "pictures"))
    pixels = any(ENCODERS[name].reads_pixels for name in plan.encoders)
    views = {
        one.key: read_views(folder, one, pictures=pixels or one.split != RANDOM) for one in every
    }
    labeled = [view for own in views.values() for view in own]
    classes = tuple(sorted({name for view in labeled for name in view.names}))
    plane = fit_plane(
        np.concatenate([view.centers for view in labeled]) / SIZE,
        np.concatenate([view.positions for view in labeled]),
    )
    shown, unseen = (
        [view for one in own if one.split != RANDOM for view in views[one.key]]
        for own in (episodes, held_back)
    )
    detector = _train_detector(shown, unseen, classes, plan, folder, progress)
    seen = {}
    for one in every:
        own, pictures = views[one.key], tuple(view.picture for view in views[one.key])
        found = _labels(own, classes) if one.split == RANDOM else detector.find(pictures)
        given = ListenerInput("", "", relate(found, plane, classes), pictures if pixels else ())
        seen[one.key] = given
    return SeenEpisodes(episodes, held_back, seen, classes, detector, plane)


def teach(scenes: SeenEpisodes, plan: TrainingPlan, kept: Path, progress: Progress) -> LearnedModel:
    """Return a listener that has learned to read; `kept` is its file after each pass."""
    torch.manual_seed(plan.seed)
    told, asked = (
        [
            (episode, scenes.seen[episode.key]._replace(task=episode.task, text=text))
            for episode, text in said(
                own, plan.settings, plan.words, goals, plan.seed, plan.language
            )
        ]
        for own, goals in ((scenes.episodes, plan.goals), (scenes.held_back, 1))
    )
    vocabulary = make_vocabulary((given.text for _, given in told), scenes.classes, plan.tasks)
    lessons, held_back = (
        [lesson_of(hide(given, plan.without), episode) for episode, given in own]
        for own in (told, asked)
    )
    reader = train_reader(
        lessons, vocabulary, plan.reader_epochs, plan.seed, progress, plan.encoders,
        KeptTraining(kept, plan.about), held_back,
    )  # fmt: skip
    return LearnedModel(vocabulary, scenes.detector, scenes.plane, reader, plan.without, plan.about)


def _labels(views: Sequence[LabeledView], classes: Sequence[str]) -> list[SeenObjects]:
    numbers = {name: number for number, name in enumerate(classes)}
    return [
        SeenObjects(
            np.array([numbers[name] for name in view.names], np.int64),
            view.centers / np.float32(SIZE),
        )
        for view in views
    ]


def _train_detector(
    shown: Sequence[LabeledView],
    held_back: Sequence[LabeledView],
    classes: Sequence[str],
    plan: TrainingPlan,
    folder: Path,
    progress: Progress,
) -> DetectorNet:
    torch.manual_seed(plan.seed)
    detector, epochs = DetectorNet(len(classes)), plan.detector_epochs
    trainer = Trainer[LabeledView](
        detector,
        lambda batch: detector_loss(detector, batch, classes),
        DETECTOR_RATE,
        epochs * batch_count(shown),
    )

    def score() -> dict[str, float]:
        groups = list(batches(held_back, random.Random(0)))
        losses = [float(detector_loss(detector, one, classes)) for one in groups]
        return {"held back": sum(losses) / len(losses)}

    made_of = [list(plan.tasks), list(classes), epochs, ENVIRONMENT_VERSION]
    trainer.learn(
        epochs,
        lambda number: batches(shown, random.Random(f"{plan.seed}/{number}")),
        partial(progress, "detector"),
        KeptTraining(folder / f"detector-{plan.seed}.pt", made_of),
        score,
    )
    return detector
