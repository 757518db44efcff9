"""Train a listener: the detector on labeled pictures, then the reader on instructions."""

from __future__ import annotations

import math
import random
from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import Any, Generic, NamedTuple, TypeVar

import torch
from torch import nn
from torch.nn import functional

from roboirg.core.episode import Episode, Split
from roboirg.core.errors import InvalidValueError
from roboirg.core.instruction_options import InstructionOptions
from roboirg.core.word_pools import PoolName
from roboirg.episodes.splits import SIZES, get_episode
from roboirg.language import FORMS, LANGUAGE_VERSION
from roboirg.language.variants import instructions
from roboirg.policies.learned.detector_net import DetectorNet, SeenObjects, detector_loss
from roboirg.policies.learned.labeled_views import LabeledView, look
from roboirg.policies.learned.learned_model import LearnedModel, Without, hide
from roboirg.policies.learned.listener_net import (
    ListenerInput,
    ListenerNet,
    Vocabulary,
    make_vocabulary,
)
from roboirg.policies.planning.goal_schema import goal_schema
from roboirg.util.parallel_map import parallel_map

TRAINING_SPLIT: Split = "train"
BATCH = 32
RATE = 1e-3
FORGOTTEN_WORDS = 0.05
"""Share of the words that are unknown in training, so that new ones do no harm."""

Progress = Callable[[str, int, int], None]
One = TypeVar("One")


class TrainingPlan(NamedTuple):
    """How a listener is trained.

    Attributes:
        tasks: names of tasks.
        settings: names of settings whose instructions it hears.
        words: the pool of words.
        scenes: random scenes of each task beyond the train split.
        detector_epochs: passes over all pictures.
        reader_epochs: passes over all instructions.
        without: what it does not get.
        seed: of initial weights and order.
    """

    tasks: tuple[str, ...]
    settings: tuple[str, ...]
    words: PoolName = "train"
    scenes: int = 0
    detector_epochs: int = 6
    reader_epochs: int = 30
    without: Without = "none"
    seed: int = 0


class _Lesson(NamedTuple):
    """An instruction with the number of its goal among those of the task."""

    given: ListenerInput
    goal: int


def train_listener(plan: TrainingPlan, workers: int, progress: Progress) -> LearnedModel:
    """Return a listener that has learned from the train split.

    Args:
        plan: how.
        workers: processes that draw pictures; 0 uses this one.
        progress: called with a stage, what is done of it, and all of it.

    Raises:
        InvalidValueError: no task has one of the settings.
    """
    torch.manual_seed(plan.seed)
    episodes = list(_episodes(plan))
    options = InstructionOptions(wordings=plan.words)
    told = [
        (episode, instruction.text)
        for episode, instruction in instructions(episodes, plan.settings, FORMS[:1], options)
    ]
    if not told:
        raise InvalidValueError(f"None of these tasks has the setting {', '.join(plan.settings)}.")
    views = _look_at(episodes, workers, progress)
    shown = [view for own in views.values() for view in own]
    names = (name for view in shown for name in view.names)
    vocabulary = make_vocabulary((text for _, text in told), names, plan.tasks)
    detector = _train_detector(shown, vocabulary, plan, progress)
    seen = {key: tuple(detector.find([view.picture for view in own])) for key, own in views.items()}
    lessons = [_lesson(episode, text, seen[episode.key], plan.without) for episode, text in told]
    reader = _train_reader(lessons, vocabulary, plan, progress)
    about: dict[str, Any] = {**plan._asdict(), "language_version": LANGUAGE_VERSION}
    about |= {"tasks": list(plan.tasks), "settings": list(plan.settings)}
    return LearnedModel(vocabulary, detector, reader, plan.without, about)


def _look_at(
    episodes: Sequence[Episode], workers: int, progress: Progress
) -> dict[str, tuple[LabeledView, ...]]:
    """Return the labeled pictures of episodes by key, in their order."""
    found: dict[str, tuple[LabeledView, ...]] = {}
    for episode, views in parallel_map(look, episodes, workers):
        found[episode.key] = views
        progress("pictures", len(found), len(episodes))
    return {episode.key: found[episode.key] for episode in episodes}


def _train_detector(
    shown: Sequence[LabeledView], vocabulary: Vocabulary, plan: TrainingPlan, progress: Progress
) -> DetectorNet:
    detector, rng = DetectorNet(len(vocabulary.classes)), random.Random(plan.seed)
    epochs = 0 if plan.without == "pictures" else plan.detector_epochs
    trainer = _Trainer[LabeledView](
        detector,
        lambda batch: detector_loss(detector, batch, vocabulary.classes),
        epochs * _batch_count(shown),
    )
    for epoch in range(epochs):
        trainer.run(_batches(shown, rng))
        progress("detector", epoch + 1, epochs)
    detector.eval()
    return detector


def _train_reader(
    lessons: Sequence[_Lesson], vocabulary: Vocabulary, plan: TrainingPlan, progress: Progress
) -> ListenerNet:
    reader, rng = ListenerNet(vocabulary), random.Random(plan.seed)
    trainer = _Trainer[_Lesson](
        reader,
        lambda batch: _reader_loss(reader, batch),
        plan.reader_epochs * _batch_count(lessons),
    )
    for epoch in range(plan.reader_epochs):
        trainer.run(_batches([_forget(one, rng) for one in lessons], rng))
        progress("reader", epoch + 1, plan.reader_epochs)
    reader.eval()
    return reader


def _episodes(plan: TrainingPlan) -> Iterator[Episode]:
    for task in plan.tasks:
        yield from (
            get_episode(task, TRAINING_SPLIT, place) for place in range(SIZES[TRAINING_SPLIT])
        )
        yield from (get_episode(task, "random", place) for place in range(plan.scenes))


def _lesson(
    episode: Episode, text: str, views: tuple[SeenObjects, ...], without: Without
) -> _Lesson:
    schema = goal_schema(episode.task)
    goal = list(schema.goals).index(schema.answers[episode.goal])
    return _Lesson(hide(ListenerInput(episode.task, text, views), without), goal)


def _forget(lesson: _Lesson, rng: random.Random) -> _Lesson:
    """Return a lesson in which some words have become unknown ones."""
    words = lesson.given.text.split()
    kept = ["…" if rng.random() < FORGOTTEN_WORDS else word for word in words]
    return lesson._replace(given=lesson.given._replace(text=" ".join(kept)))


def _reader_loss(net: ListenerNet, batch: Sequence[_Lesson]) -> torch.Tensor:
    scores = net([one.given for one in batch])
    losses = [
        functional.cross_entropy(own[None], torch.tensor([one.goal]))
        for own, one in zip(scores, batch, strict=True)
    ]
    return torch.stack(losses).mean()


def _batch_count(lessons: Sequence[object]) -> int:
    return math.ceil(len(lessons) / BATCH)


def _batches(lessons: Sequence[One], rng: random.Random) -> Iterator[list[One]]:
    order = rng.sample(range(len(lessons)), len(lessons))
    for start in range(0, len(order), BATCH):
        yield [lessons[place] for place in order[start : start + BATCH]]


class _Trainer(Generic[One]):
    """Trains a network with AdamW; the rate falls to zero along a cosine."""

    def __init__(
        self, net: nn.Module, loss_of: Callable[[Sequence[One]], torch.Tensor], steps: int
    ) -> None:
        self._net, self._loss_of = net, loss_of
        self._optimizer = torch.optim.AdamW(net.parameters(), lr=RATE, weight_decay=0.01)
        self._schedule = torch.optim.lr_scheduler.OneCycleLR(
            self._optimizer, RATE, total_steps=max(steps, 1), pct_start=0.1
        )

    def run(self, batches: Iterable[Sequence[One]]) -> None:
        """Take a step for each batch."""
        self._net.train()
        for batch in batches:
            self._optimizer.zero_grad()
            self._loss_of(batch).backward()
            nn.utils.clip_grad_norm_(self._net.parameters(), 1.0)
            self._optimizer.step()
            self._schedule.step()
