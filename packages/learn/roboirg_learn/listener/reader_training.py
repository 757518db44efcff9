"""Train the reader: instructions with what is seen, and the goals that they mean.

A lesson is one instruction with what is seen and the goal that is meant. Lessons are held back to
show how well the training goes.
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
    Course,
    KeptTraining,
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

    Explicit words and harder settings are spoken for the episode's own goal only; all others for
    more goals of the same scene, too, because there the meaning hangs on what is in it.
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
        seed: of the choice.
    """
    rng = random.Random(seed)
    for episode in episodes:
        yield episode
        others = [goal for goal in goals_of(episode) if goal != episode.goal]
        count = min(goals - 1, len(others))
        for goal in rng.sample(others, count):
            yield with_goal(episode, goal)


def check_reader(plan: ReaderPlan) -> None:
    """Check a plan before pictures are drawn for it.

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


class Lesson(NamedTuple):
    """An instruction with the number of its goal among those of the task."""

    given: ListenerInput
    goal: int


def lesson_of(given: ListenerInput, episode: Episode) -> Lesson:
    """Return an instruction with the number of the goal that it means: the episode's own."""
    schema = goal_schema(episode.task)
    answers = list(schema.goals)
    return Lesson(given, answers.index(schema.answers[episode.goal]))


def train_reader(
    lessons: Sequence[Lesson],
    vocabulary: Vocabulary,
    plan: ReaderPlan,
    progress: Progress,
    kept: KeptTraining,
    held_back: Sequence[Lesson] = (),
) -> ListenerNet:
    """Train a reader: a network that scores the goals that an instruction may mean.

    Args:
        lessons: the instructions.
        vocabulary: what it can name.
        plan: its passes, seed and encoders.
        progress: called after each pass.
        kept: where the training is kept.
        held_back: what shows how training goes.
    """
    course = ReaderCourse(lessons, vocabulary, plan, held_back)
    Training(course).run(partial(progress, "reader"), kept)
    return course.net


class ReaderCourse(Course[Lesson]):
    """A reader learns which goals instructions mean; arguments as of `train_reader`."""

    net: ListenerNet
    rate = READER_RATE

    def __init__(
        self,
        lessons: Sequence[Lesson],
        vocabulary: Vocabulary,
        plan: ReaderPlan,
        held_back: Sequence[Lesson],
    ) -> None:
        self._lessons = lessons
        self._held_back = held_back
        self._seed = plan.seed
        self.net = ListenerNet(vocabulary, plan.encoders)
        self.epochs = plan.reader_epochs
        self.steps = batch_count(lessons)

    def batches(self, epoch: int) -> Iterator[list[Lesson]]:
        """Yield all lessons in batches, with other words unknown in each pass."""
        rng = random.Random(f"{self._seed}/{epoch}")
        lessons = [_with_unknown_words(lesson, rng) for lesson in self._lessons]
        return even_batches(lessons, rng, _length)

    def loss(self, batch: Sequence[Lesson]) -> torch.Tensor:
        """Return the mean cross-entropy; lessons go one by one, as tasks differ in goals."""
        losses = []
        for lesson, scores in self._scored(batch):
            goal = torch.tensor([lesson.goal])
            losses.append(functional.cross_entropy(scores[None], goal))
        return torch.stack(losses).mean()

    def score(self) -> dict[str, float]:
        """Return the share of held-back lessons whose goal scores best; {} without any."""
        if not self._held_back:
            return {}
        right = 0
        for batch in even_batches(self._held_back, random.Random(0), _length):
            for lesson, scores in self._scored(batch):
                right += int(scores.argmax()) == lesson.goal
        return {"held back right": right / len(self._held_back)}

    def _scored(self, batch: Sequence[Lesson]) -> Iterator[tuple[Lesson, torch.Tensor]]:
        """Yield each lesson with the scores of its task's goals."""
        scores = self.net([lesson.given for lesson in batch])
        return zip(batch, scores, strict=True)


def _with_unknown_words(lesson: Lesson, rng: random.Random) -> Lesson:
    """Return a lesson with a random twentieth of its words replaced by the unknown word "…"."""
    words = []
    for word in lesson.given.text.split():
        is_forgotten = rng.random() < FORGOTTEN_WORDS
        words.append("…" if is_forgotten else word)
    given = lesson.given._replace(text=" ".join(words))
    return lesson._replace(given=given)


def _length(lesson: Lesson) -> int:
    """Return about how many words are said, so that batches are even."""
    return lesson.given.text.count(" ")
