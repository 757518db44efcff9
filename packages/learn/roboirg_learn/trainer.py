"""Training of small networks: batches, and steps with a falling rate.

An epoch is a pass over all that is learned from, a batch is what one step learns from. A training
is kept in a file after each epoch, so that a command that was killed goes on.
"""

from __future__ import annotations

import math
import random
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, Generic, NamedTuple, Protocol, TypeVar

import torch
from torch import nn

from roboirg_learn.trained_file import load_unfinished, save_unfinished

BATCH = 32
RISING_SHARE = 0.1
"""Of all steps, those in which the rate rises."""
SPOILED_TOTAL = 10
"""Number of steps at which PyTorch's schedule divides by 0: its rising tenth takes no time."""
MOST_GRADIENT = 1.0
"""Norm to which gradients are clipped."""
Item = TypeVar("Item")
Curve = list[dict[str, float]]
"""Of each pass the mean loss, and the score after it."""


class Progress(Protocol):
    """Shows what is done of a kind of work, all of it, and how well it goes."""

    def __call__(self, work: str, done: int, total: int, note: str = "") -> None:
        """Show it."""


def part_of(progress: Progress, name: str) -> Progress:
    """Return a progress that puts a name before the work: "detector" → "small-ttt: detector"."""
    return lambda work, *done: progress(f"{name}: {work}", *done)


class KeptTraining(NamedTuple):
    """The file in which a training is kept after each pass, and all that the result depends on."""

    path: Path
    made_of: object


def batch_count(lessons: Sequence[object]) -> int:
    """Return how many batches lessons make, the last one maybe smaller."""
    return math.ceil(len(lessons) / BATCH)


def batches(lessons: Sequence[Item], rng: random.Random, size: int = BATCH) -> Iterator[list[Item]]:
    """Yield lessons in random order, in batches."""
    mixed = rng.sample(lessons, len(lessons))
    for start in range(0, len(mixed), size):
        yield mixed[start : start + size]


def even_batches(
    lessons: Sequence[Item], rng: random.Random, length: Callable[[Item], int], size: int = BATCH
) -> Iterator[list[Item]]:
    """Yield batches of lessons of about equal length, in random order, so that little is padding.

    Args:
        lessons: mixed first, so that those of equal length meet others in each pass.
        rng: mixes lessons and batches.
        length: of a lesson.
        size: most lessons of a batch.
    """
    by_length = sorted(rng.sample(lessons, len(lessons)), key=length)
    groups = [by_length[start : start + size] for start in range(0, len(by_length), size)]
    yield from rng.sample(groups, len(groups))


class Course(ABC, Generic[Item]):
    """What a network learns: in which order, for how long, and how wrong it is.

    Attributes:
        net: the network, untrained at first.
        rate: the greatest learning rate, between a short rise and a long fall.
        epochs: passes over all that is learned from.
        steps: batches of a pass.
    """

    net: nn.Module
    rate: float
    epochs: int
    steps: int

    @abstractmethod
    def batches(self, epoch: int) -> Iterable[Sequence[Item]]:
        """Return what is learned from in a pass, numbered from 0."""

    @abstractmethod
    def loss(self, batch: Sequence[Item]) -> torch.Tensor:
        """Return how wrong the network is about a batch."""

    def score(self) -> Mapping[str, float]:
        """Return how good the network is now, by the names of measures."""
        return {}


class Training:
    """Trains a network with AdamW; the rate falls to zero along a cosine.

    Args:
        course: what it learns.
    """

    def __init__(self, course: Course[Any]) -> None:
        self._course = course
        self._net = course.net
        self._optimizer = torch.optim.AdamW(
            course.net.parameters(), lr=course.rate, weight_decay=0.01
        )
        # The rate rises for a tenth of all steps, then falls along a cosine.
        total = max(course.epochs * course.steps, 1)
        if total == SPOILED_TOTAL:
            total += 1
        self._schedule = torch.optim.lr_scheduler.OneCycleLR(
            self._optimizer, course.rate, total_steps=total, pct_start=RISING_SHARE
        )
        self._curve: list[dict[str, float]] = []

    def run(self, show: Callable[[int, int, str], None], kept: KeptTraining) -> Curve:
        """Train the network for all epochs, or go on where a kept training stopped.

        Returns the loss and the scores of each epoch.

        Args:
            show: called after each epoch with its number from 1, the number of all, and a note of
                loss and scores.
            kept: the file in which the training is kept after each epoch.
        """
        self._restore(kept)
        epochs = self._course.epochs
        for epoch in range(len(self._curve), epochs):
            loss = self._learn_from(self._course.batches(epoch))
            self._net.eval()
            with torch.no_grad():
                measures = {"loss": loss, **self._course.score()}
            self._curve.append(measures)
            self._keep(kept)
            note = ", ".join(f"{name} {value:.3f}" for name, value in measures.items())
            show(epoch + 1, epochs, note)
        self._net.eval()
        return self._curve

    def _learn_from(self, batches: Iterable[Sequence[Any]]) -> float:
        """Take one step of the optimizer for each batch; return the mean loss before the steps."""
        self._net.train()
        losses = []
        for batch in batches:
            self._optimizer.zero_grad()
            loss: Any = self._course.loss(batch)
            loss.backward()
            losses.append(float(loss.detach()))
            nn.utils.clip_grad_norm_(self._net.parameters(), MOST_GRADIENT)
            self._optimizer.step()
            self._schedule.step()
        return sum(losses) / max(1, len(losses))

    @property
    def _parts(self) -> dict[str, Any]:
        """What has a state that changes from step to step, by its name in the kept file."""
        return {"net": self._net, "optimizer": self._optimizer, "schedule": self._schedule}

    def _restore(self, kept: KeptTraining) -> None:
        """Load the training of a file, with PyTorch's random state, if it is of this training."""
        state = load_unfinished(kept.path, kept.made_of)
        if state is None or "found" not in state:
            return
        for name, part in self._parts.items():
            part.load_state_dict(state[name])
        torch.set_rng_state(state["random"])
        self._curve = state["found"]

    def _keep(self, kept: KeptTraining) -> None:
        """Write all that is needed to go on after this epoch: states, curve, and random numbers."""
        state = {name: part.state_dict() for name, part in self._parts.items()}
        state["random"] = torch.get_rng_state()
        state["found"] = self._curve
        state["made_of"] = kept.made_of
        save_unfinished(state, kept.path)
