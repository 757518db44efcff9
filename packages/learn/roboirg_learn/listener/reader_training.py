"""Train the reader: instructions with what is seen, and the goals that they mean.

A reader is the network that scores goals. An example is one instruction with what is seen and the
goal that is meant; validation examples show how well the training goes.
"""

from __future__ import annotations

import random
from collections.abc import Iterable, Iterator, Sequence
from functools import partial
from typing import NamedTuple

import torch
from torch.nn import functional

from roboirg.extension.commands import InvalidValueError
from roboirg.extension.episodes import (
    Episode,
    all_settings,
    episodes_of,
    goal_schema,
    goals_of,
    spoken,
    with_goal,
)
from roboirg_learn.listener.encoders import make_encoders
from roboirg_learn.listener.listener_net import ListenerNet
from roboirg_learn.listener.reader_plan import ReaderPlan
from roboirg_learn.listener.vocabulary import ListenerInput, Vocabulary, make_vocabulary
from roboirg_learn.trainer import (
    Checkpoint,
    Course,
    Progress,
    Training,
    batch_count,
    even_batches,
)

READER_RATE = 1e-3
FORGOTTEN_WORDS = 0.05
"""Share of the words that are unknown in training, so that new ones do no harm."""


def instructions_of(episodes: Sequence[Episode], plan: ReaderPlan) -> Iterator[tuple[Episode, str]]:
    """Yield episodes with instructions that a reader learns from, in the settings of its plan.

    Explicit words and harder settings (those built on a plain one) are spoken for the episode's own
    goal only; all others for more goals of the same scene, too, because there the meaning depends
    on what is in it. An episode with another goal is a copy with that goal.
    """
    known = all_settings()
    for_own_goal = []
    for_every_goal = []
    for name in plan.settings:
        if name == "explicit" or known[name].plain is not None:
            for_own_goal.append(name)
        else:
            for_every_goal.append(name)
    yield from spoken(episodes, for_own_goal, plan.words)
    with_goals = list(with_more_goals(episodes, plan.goals, plan.seed))
    yield from spoken(with_goals, for_every_goal, plan.words)


def with_more_goals(episodes: Iterable[Episode], goals: int, seed: int) -> Iterator[Episode]:
    """Yield each episode, then copies of it with other goals that its scene allows.

    Args:
        episodes: any.
        goals: how many goals each scene has in all, if it allows so many.
        seed: of the choice, which is one sequence over all episodes.
    """
    rng = random.Random(seed)
    for episode in episodes:
        yield episode
        others = [goal for goal in goals_of(episode) if goal != episode.goal]
        count = min(goals - 1, len(others))
        for goal in rng.sample(others, count):
            yield with_goal(episode, goal)


def check_reader(plan: ReaderPlan) -> None:
    """Check a plan before pictures are rendered for it.

    Raises:
        InvalidValueError: a task has no words, no task has the settings, or an encoder does not
            take its own settings.
        UnknownNameError: there is no encoder of a name.
    """
    tasks = plan.tasks
    plain = spoken(episodes_of(tasks, "train", 1), ["explicit"], "train")
    with_words = {episode.task for episode, _ in plain}
    without_words = sorted(set(tasks) - with_words)
    if without_words:
        raise InvalidValueError(
            f"There are no words of {', '.join(without_words)}; name other tasks."
        )
    instructions = spoken(episodes_of(tasks, "train", 10), plan.settings, "train")
    if plan.settings and not any(instructions):
        raise InvalidValueError(f"None of these tasks has the setting {', '.join(plan.settings)}.")
    make_encoders(make_vocabulary(["a"], ["cube"], tasks), plan.encoders)


class Example(NamedTuple):
    """An instruction with what is seen, and the number of its goal in the task's schema."""

    given: ListenerInput
    goal: int


def example_of(given: ListenerInput, episode: Episode) -> Example:
    """Return an example whose goal is the episode's own.

    Args:
        given: the instruction, and what is seen of the episode.
        episode: with the goal that is meant.
    """
    schema = goal_schema(episode.task)
    answers = list(schema.goals)
    return Example(given, answers.index(schema.answers[episode.goal]))


def train_reader(
    examples: Sequence[Example],
    vocabulary: Vocabulary,
    plan: ReaderPlan,
    progress: Progress,
    checkpoint: Checkpoint,
    validation: Sequence[Example] = (),
) -> ListenerNet:
    """Train a reader: a network that scores the goals that an instruction may mean.

    Args:
        examples: to learn from.
        vocabulary: what it can read and name.
        plan: its epochs, seed and encoders.
        progress: called after each epoch.
        checkpoint: from which an interrupted training goes on.
        validation: examples that show how training goes; may be empty.
    """
    course = ReaderCourse(examples, vocabulary, plan, validation)
    Training(course).run(partial(progress, "reader"), checkpoint)
    return course.net


class ReaderCourse(Course[Example]):
    """A reader learns which goals instructions mean; arguments as of `train_reader`."""

    net: ListenerNet
    learning_rate = READER_RATE

    def __init__(
        self,
        examples: Sequence[Example],
        vocabulary: Vocabulary,
        plan: ReaderPlan,
        validation: Sequence[Example],
    ) -> None:
        self._examples = examples
        self._validation = validation
        self._seed = plan.seed
        self.net = ListenerNet(vocabulary, plan.encoders)
        self.epochs = plan.reader_epochs
        self.steps_per_epoch = batch_count(examples)

    def batches(self, epoch: int) -> Iterator[list[Example]]:
        """Return all examples in batches, with other words unknown in each epoch."""
        rng = random.Random(f"{self._seed}/{epoch}")
        examples = [_with_unknown_words(example, rng) for example in self._examples]
        return even_batches(examples, rng, _length)

    def loss(self, batch: Sequence[Example]) -> torch.Tensor:
        """Return the mean cross-entropy of the right goals.

        Examples go one by one, because tasks differ in how many goals they have.
        """
        losses = []
        for example, scores in self._scored(batch):
            goal = torch.tensor([example.goal])
            losses.append(functional.cross_entropy(scores[None], goal))
        return torch.stack(losses).mean()

    def score(self) -> dict[str, float]:
        """Return the share of validation examples whose goal scores best; {} without any."""
        if not self._validation:
            return {}
        right = 0
        for batch in even_batches(self._validation, random.Random(0), _length):
            for example, scores in self._scored(batch):
                right += int(scores.argmax()) == example.goal
        return {"held back right": right / len(self._validation)}

    def _scored(self, batch: Sequence[Example]) -> Iterator[tuple[Example, torch.Tensor]]:
        """Yield each example with the scores (goals,) of its task's goals."""
        scores = self.net([example.given for example in batch])
        return zip(batch, scores, strict=True)


def _with_unknown_words(example: Example, rng: random.Random) -> Example:
    """Return an example with a random twentieth of its words replaced by "…".

    No vocabulary has that word, so it is read as the unknown one.
    """
    words = []
    for word in example.given.text.split():
        is_forgotten = rng.random() < FORGOTTEN_WORDS
        words.append("…" if is_forgotten else word)
    given = example.given._replace(text=" ".join(words))
    return example._replace(given=given)


def _length(example: Example) -> int:
    """Return about how many words an example has, so that batches are even."""
    return example.given.text.count(" ")
