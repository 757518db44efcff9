"""Train the reader: instructions with what is seen, and the goals that they mean."""

from __future__ import annotations

import random
from collections.abc import Iterable, Iterator, Mapping, Sequence
from functools import partial
from typing import Any, NamedTuple

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
from roboirg_learn.listener.vocabulary import ListenerInput, Vocabulary, make_vocabulary
from roboirg_learn.trainer import (
    KeptTraining,
    Progress,
    Trainer,
    batch_count,
    even_batches,
)  # fmt: skip

READER_RATE = 1e-3
FORGOTTEN_WORDS = 0.05
"""Share of the words that are unknown in training, so that new ones do no harm."""


def said(
    episodes: Sequence[Episode],
    settings: Sequence[str],
    words: str,
    goals: int,
    seed: int,
    language: int,
) -> Iterator[tuple[Episode, str]]:
    """Yield the instructions of episodes, and of more goals of each scene.

    Args:
        episodes: the episodes.
        settings: names; harder ones are left out where they cannot express an episode.
        words: the pool of words.
        goals: of each scene with an implicit instruction, which hangs on what is there and on what
            was said before; explicit and harder settings have the scene's own only.
        seed: draws the goals.
        language: version of the words.
    """
    known = all_settings()
    of_one = [name for name in settings if name == "explicit" or known[name].plain is not None]
    of_more = [name for name in settings if name not in of_one]
    yield from spoken(episodes, of_one, words, language)
    yield from spoken(list(with_more_goals(episodes, goals, seed)), of_more, words, language)


def with_more_goals(episodes: Iterable[Episode], goals: int, seed: int) -> Iterator[Episode]:
    """Yield each episode, and again with other goals of its scene."""
    rng = random.Random(seed)
    for episode in episodes:
        yield episode
        every = goals_of(episode)
        others = [goal for goal in every if goal != episode.goal]
        for goal in rng.sample(others, min(goals - 1, len(others))):
            yield with_goal(episode, goal)


def check_reader(
    tasks: Sequence[str],
    settings: Sequence[str],
    encoders: Mapping[str, Mapping[str, Any]],
    language: int,
) -> None:
    """Raise early what would else be raised after pictures are drawn, or never."""
    plain = spoken(episodes_of(tasks, "train", 1), ["explicit"], "train", language)
    if silent := {*tasks} - {episode.task for episode, _ in plain}:
        raise InvalidValueError(
            f"Language {language} has no words for {', '.join(sorted(silent))}; name other tasks."
        )
    if settings and not any(spoken(episodes_of(tasks, "train", 10), settings, "train", language)):
        raise InvalidValueError(f"None of these tasks has the setting {', '.join(settings)}.")
    make_encoders(make_vocabulary(["a"], ["cube"], tasks), encoders)


class Lesson(NamedTuple):
    """An instruction with the number of its goal among those of the task."""

    given: ListenerInput
    goal: int


def lesson_of(given: ListenerInput, episode: Episode) -> Lesson:
    """Return an instruction with its goal, the episode's own."""
    schema = goal_schema(episode.task)
    return Lesson(given, list(schema.goals).index(schema.answers[episode.goal]))


def train_reader(
    lessons: Sequence[Lesson],
    vocabulary: Vocabulary,
    epochs: int,
    seed: int,
    progress: Progress,
    encoders: Mapping[str, Mapping[str, Any]],
    kept: KeptTraining,
    held_back: Sequence[Lesson] = (),
) -> ListenerNet:
    """Return a reader that has learned from instructions.

    Args:
        lessons: the instructions.
        vocabulary: what it can name.
        epochs: passes over all of them.
        seed: of their order.
        progress: called after each pass.
        encoders: by name, with their settings.
        kept: where the training is kept.
        held_back: what shows how training goes.
    """
    reader = ListenerNet(vocabulary, encoders)
    trainer = Trainer[Lesson](
        reader,
        lambda batch: _reader_loss(reader, batch),
        READER_RATE,
        epochs * batch_count(lessons),
    )

    def mixed(number: int) -> Iterator[list[Lesson]]:
        rng = random.Random(f"{seed}/{number}")
        return even_batches([_forget(one, rng) for one in lessons], rng, _length)

    def score() -> dict[str, float]:
        right = [
            int(scores.argmax()) == one.goal
            for batch in even_batches(held_back, random.Random(0), _length)
            for scores, one in zip(reader([one.given for one in batch]), batch, strict=True)
        ]
        return {"held back right": sum(right) / len(right)} if right else {}

    trainer.learn(epochs, mixed, partial(progress, "reader"), kept, score)
    return reader


def _forget(lesson: Lesson, rng: random.Random) -> Lesson:
    """Return a lesson in which some words have become unknown ones."""
    words = lesson.given.text.split()
    kept = ["…" if rng.random() < FORGOTTEN_WORDS else word for word in words]
    return lesson._replace(given=lesson.given._replace(text=" ".join(kept)))


def _reader_loss(net: ListenerNet, batch: Sequence[Lesson]) -> torch.Tensor:
    scores = net([one.given for one in batch])
    losses = [
        functional.cross_entropy(own[None], torch.tensor([one.goal]))
        for own, one in zip(scores, batch, strict=True)
    ]
    return torch.stack(losses).mean()


def _length(lesson: Lesson) -> int:
    return lesson.given.text.count(" ")
