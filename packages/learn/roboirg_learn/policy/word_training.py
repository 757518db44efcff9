"""Train the reader of a policy: first looks of scenes, and the instructions that go with them.

A reader names task and goal of an instruction in a scene, which it sees by a body's detector.
"""

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
    Example,
    check_reader,
    example_of,
    instructions_of,
    train_reader,
)
from roboirg_learn.listener.vocabulary import ListenerInput, Vocabulary, words_of
from roboirg_learn.policy.task_net import TaskNet
from roboirg_learn.policy.trained_body import TrainedBody
from roboirg_learn.policy.trained_reader import TrainedReader, seen_things
from roboirg_learn.trainer import (
    Checkpoint,
    Course,
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
    """Scenes as a body's detector sees them at first.

    Attributes:
        seen: the objects found in each scene, with ranks, by the episode's key.
        corners: (4, 2) x and y of the corners of the area where objects stand, m.
    """

    seen: dict[str, ObjectsInView]
    corners: NDArray[np.float64]


def check_words(plan: ReaderPlan) -> None:
    """Check the plan of a policy's reader, before hours are spent on it.

    Raises:
        InvalidValueError: the plan cannot be followed; see also `check_reader`.
    """
    check_reader(plan)
    for name in plan.encoders:
        if ENCODERS[name].reads_pixels:
            raise InvalidValueError(f"Encoder {name!r} reads pixels; a policy's reader has none.")


def train_policy_reader(
    body: TrainedBody, plan: ReaderPlan, folder: Path, name: str, workers: int, progress: Progress
) -> TrainedReader:
    """Train a reader of words for a body: two networks, which name the task and then the goal.

    Args:
        body: of a file; its detector sees the scenes.
        plan: its tasks, settings, passes and seed.
        folder: for the checkpoints, from which an interrupted training goes on.
        name: of the reader, among those of the folder.
        workers: processes that render; 0 uses this one.
        progress: called with a kind of work, what is done of it, and all of it.
    """
    train = episodes_of(plan.tasks, "train")
    episodes = (*train, *episodes_of(plan.tasks, "random", plan.scenes))
    scenes = _see_scenes(body, episodes, workers, progress)
    examples = _examples(plan, episodes, scenes)
    vocabulary = _vocabulary(examples, body)
    about = {**plan.about, "body": body.version}

    # One seed for both networks, so the first must be trained first.
    torch.manual_seed(plan.seed)
    course = TaskCourse(plan, examples, vocabulary)
    task_checkpoint = Checkpoint(folder / f"tasks-{name}.pt", about)
    Training(course).run(partial(progress, "tasks"), task_checkpoint)
    reader_checkpoint = Checkpoint(folder / f"words-{name}.pt", about)
    net = train_reader(examples, vocabulary, plan, progress, reader_checkpoint)
    return TrainedReader(vocabulary, scenes.corners, course.net, net, about)


def _vocabulary(examples: Sequence[Example], body: TrainedBody) -> Vocabulary:
    """Return the words of examples, with classes, tasks and parts of goals as the body has them.

    So numbers mean the same to both; `load_policy` refuses others.
    """
    words = words_of(example.given.text for example in examples)
    return Vocabulary(words, body.object_classes.names, body.goals.tasks, body.goals.parts)


def _examples(plan: ReaderPlan, episodes: Sequence[Episode], scenes: SeenScenes) -> list[Example]:
    """Return what a reader learns: instructions, each with what is seen at first and its goal.

    A plan without settings makes a reader without words: one empty instruction for each episode.
    """
    instructions = [(episode, "") for episode in episodes]
    if plan.settings:
        instructions = list(instructions_of(episodes, plan))
    examples = []
    for episode, text in instructions:
        given = ListenerInput(episode.task, text, scenes.seen[episode.key])
        examples.append(example_of(given, episode))
    return examples


def _see_scenes(
    body: TrainedBody, episodes: Sequence[Episode], workers: int, progress: Progress
) -> SeenScenes:
    """Render the first pictures of episodes, and return what the body's detector finds in them.

    No expert plays the episodes.
    """
    looks = {}
    positions = []  # of all objects that the simulator shows, for the corners
    for episode, views in parallel_map(views_at_start, episodes, workers):
        looks[episode.key] = body.see([view.picture for view in views])
        positions.append(views[0].positions)
        progress("scenes", len(looks), len(episodes))
    corners = corners_of(np.concatenate(positions))
    seen = {}
    for key, detections in looks.items():
        seen[key] = seen_things(detections, corners, body.object_classes.names)
    return SeenScenes(seen, corners)


class TaskCourse(Course[Example]):
    """A small network learns which task an instruction is of; some words are left out."""

    net: TaskNet
    learning_rate = TASK_RATE
    epochs = TASK_EPOCHS

    def __init__(
        self, plan: ReaderPlan, examples: Sequence[Example], vocabulary: Vocabulary
    ) -> None:
        self._seed = plan.seed
        self._rng = random.Random(plan.seed)
        self._examples = examples
        self._tasks = vocabulary.tasks
        self.net = TaskNet(vocabulary)
        self.steps_per_epoch = batch_count(examples)

    def batches(self, epoch: int) -> Iterator[list[Example]]:
        """Yield the examples in random batches; the seed also decides which words are left out."""
        self._rng.seed(f"{self._seed}/{epoch}")
        return batches(self._examples, self._rng)

    def loss(self, batch: Sequence[Example]) -> torch.Tensor:
        """Return the mean cross-entropy of the tasks, named from texts that lack some words."""
        texts = [_without_some_words(example.given.text, self._rng) for example in batch]
        right = [self._tasks.index(example.given.task) for example in batch]
        scores = self.net(texts, [example.given.seen for example in batch])
        return functional.cross_entropy(scores, torch.tensor(right))


def _without_some_words(text: str, rng: random.Random) -> str:
    """Return a text without a random tenth of its words (`FORGOTTEN_WORDS`)."""
    return " ".join(word for word in text.split() if rng.random() >= FORGOTTEN_WORDS)
