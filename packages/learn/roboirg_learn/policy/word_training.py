"""Train the reader of a policy: first looks of scenes, and the instructions that go with them."""

from __future__ import annotations

import random
from collections.abc import Iterator, Sequence
from functools import partial
from pathlib import Path
from typing import NamedTuple

import numpy as np
import torch
from numpy.typing import NDArray
from torch.nn import functional

from roboirg.extension.commands import InvalidValueError, parallel_map
from roboirg.extension.episodes import Episode, episodes_of
from roboirg_learn.labeled_views import views_at_start
from roboirg_learn.listener.encoders import ENCODERS
from roboirg_learn.listener.object_relations import ObjectsInView, corners_of
from roboirg_learn.listener.reader_plan import ReaderPlan
from roboirg_learn.listener.reader_training import (
    Lesson,
    check_reader,
    instructions_of,
    lesson_of,
    train_reader,
)
from roboirg_learn.listener.vocabulary import ListenerInput, Vocabulary, words_of
from roboirg_learn.policy.task_net import TaskNet
from roboirg_learn.policy.trained_body import TrainedBody
from roboirg_learn.policy.trained_reader import TrainedReader, seen_things
from roboirg_learn.trainer import (
    Course,
    KeptTraining,
    Progress,
    Training,
    batch_count,
    batches,
)

TASK_EPOCHS = 6
TASK_RATE = 5e-3
FORGOTTEN_WORDS = 0.1
"""Share of the words that the task must be named without."""


class SeenScenes(NamedTuple):
    """Scenes as a body sees them at first.

    Attributes:
        seen: what is seen of each, by the episode's key.
        corners: (4, 2) of the area where things stand, m.
    """

    seen: dict[str, ObjectsInView]
    corners: NDArray[np.float64]


def check_words(plan: ReaderPlan) -> None:
    """Raise early what would else be raised after hours.

    Raises:
        InvalidValueError: the plan cannot be followed.
    """
    check_reader(plan)
    for name in plan.encoders:
        if ENCODERS[name].reads_pixels:
            raise InvalidValueError(f"Encoder {name!r} reads pixels; a policy's reader has none.")


def train_policy_reader(
    body: TrainedBody, plan: ReaderPlan, folder: Path, name: str, workers: int, progress: Progress
) -> TrainedReader:
    """Train a reader of words for a body: it names task and goal of an instruction in a scene.

    Args:
        body: of a file; its detector sees the scenes.
        plan: its tasks, settings, passes and seed.
        folder: for what is learned on the way, from which an interrupted training goes on.
        name: of the reader, among those of the folder.
        workers: processes that draw; 0 uses this one.
        progress: called with a kind of work, what is done of it, and all of it.
    """
    train = episodes_of(plan.tasks, "train")
    episodes = (*train, *episodes_of(plan.tasks, "random", plan.scenes))
    scenes = _view_scenes(body, episodes, workers, progress)
    lessons = _lessons(plan, episodes, scenes)
    vocabulary = _vocabulary(lessons, body)
    about = {**plan.about, "body": body.version}

    torch.manual_seed(plan.seed)
    course = TaskCourse(plan, lessons, vocabulary)
    kept_tasks = KeptTraining(folder / f"tasks-{name}.pt", about)
    Training(course).run(partial(progress, "tasks"), kept_tasks)
    kept_words = KeptTraining(folder / f"words-{name}.pt", about)
    net = train_reader(lessons, vocabulary, plan, progress, kept_words)
    return TrainedReader(vocabulary, scenes.corners, course.net, net, about)


def _vocabulary(lessons: Sequence[Lesson], body: TrainedBody) -> Vocabulary:
    """Return the words of lessons, with classes, tasks and parts of goals as the body has them."""
    words = words_of(lesson.given.text for lesson in lessons)
    return Vocabulary(words, body.sight.classes, body.goals.tasks, body.goals.parts)


def _lessons(plan: ReaderPlan, episodes: Sequence[Episode], scenes: SeenScenes) -> list[Lesson]:
    """Return what a reader learns: an instruction, what is seen at first, and the goal meant.

    A plan without settings makes a reader without words: one empty instruction for each episode.
    """
    instructions = [(episode, "") for episode in episodes]
    if plan.settings:
        instructions = list(instructions_of(episodes, plan))
    lessons = []
    for episode, text in instructions:
        given = ListenerInput(episode.task, text, scenes.seen[episode.key])
        lessons.append(lesson_of(given, episode))
    return lessons


def _view_scenes(
    body: TrainedBody, episodes: Sequence[Episode], workers: int, progress: Progress
) -> SeenScenes:
    """Draw the first pictures of episodes, and return what the body's detector finds in them.

    No expert plays the episodes.
    """
    looks = {}
    positions = []
    for episode, views in parallel_map(views_at_start, episodes, workers):
        looks[episode.key] = body.see([view.picture for view in views])
        positions.append(views[0].positions)
        progress("scenes", len(looks), len(episodes))
    corners = corners_of(np.concatenate(positions))
    seen = {}
    for key, tokens in looks.items():
        seen[key] = seen_things(tokens, corners, body.sight.classes)
    return SeenScenes(seen, corners)


class TaskCourse(Course[Lesson]):
    """A small network learns which task an instruction is of; some words are left out."""

    net: TaskNet
    rate = TASK_RATE
    epochs = TASK_EPOCHS

    def __init__(self, plan: ReaderPlan, lessons: Sequence[Lesson], vocabulary: Vocabulary) -> None:
        self._seed = plan.seed
        self._rng = random.Random(plan.seed)
        self._lessons = lessons
        self._tasks = vocabulary.tasks
        self.net = TaskNet(vocabulary)
        self.steps = batch_count(lessons)

    def batches(self, epoch: int) -> Iterator[list[Lesson]]:
        """Yield the lessons in random batches; the seed also decides which words are left out."""
        self._rng.seed(f"{self._seed}/{epoch}")
        return batches(self._lessons, self._rng)

    def loss(self, batch: Sequence[Lesson]) -> torch.Tensor:
        """Return the mean cross-entropy of the tasks, named from texts that lack some words."""
        texts = [_without_some_words(lesson.given.text, self._rng) for lesson in batch]
        right = [self._tasks.index(lesson.given.task) for lesson in batch]
        scores = self.net(texts, [lesson.given.seen for lesson in batch])
        return functional.cross_entropy(scores, torch.tensor(right))


def _without_some_words(text: str, rng: random.Random) -> str:
    """Return a text without a random tenth of its words (`FORGOTTEN_WORDS`)."""
    return " ".join(word for word in text.split() if rng.random() >= FORGOTTEN_WORDS)
