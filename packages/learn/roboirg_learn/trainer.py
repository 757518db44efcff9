"""Training of small networks: batches, and steps with a falling learning rate.

An epoch is a pass over all examples, a batch is what one step learns from. A course is one network
with its examples and its loss, which a training goes through. A checkpoint is written after each
epoch, so that a command that was killed goes on.
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

from roboirg_learn.trained_file import load_checkpoint, save_checkpoint

BATCH = 32
"""Examples of a batch unless a course has its own size."""
RISING_SHARE = 0.1
"""Of all steps, those in which the learning rate rises."""
SPOILED_TOTAL = 10
"""Number of steps at which PyTorch's schedule divides by 0: its rising tenth takes no time."""
MOST_GRADIENT = 1.0
"""Norm to which gradients are clipped."""
Item = TypeVar("Item")
Curve = list[dict[str, float]]
"""Of each epoch the mean loss, and the scores after it."""


class Progress(Protocol):
    """Shows how far a kind of work is, and how well it goes."""

    def __call__(self, work: str, done: int, total: int, note: str = "") -> None:
        """Show it.

        Args:
            work: what is done, such as ``recordings``.
            done: how much of it.
            total: all of it.
            note: such as the loss.
        """


def part_of(progress: Progress, name: str) -> Progress:
    """Return a progress that puts a name before the work: "detector" → "small-ttt: detector"."""
    return lambda work, *done: progress(f"{name}: {work}", *done)


class Checkpoint(NamedTuple):
    """Where the state of a training is kept after each epoch.

    Attributes:
        path: of the file.
        made_of: all that the result depends on, as plain data; the file of a training with another
            one is not used.
    """

    path: Path
    made_of: object


def batch_count(examples: Sequence[object]) -> int:
    """Return how many batches of `BATCH` examples there are, the last one maybe smaller."""
    return math.ceil(len(examples) / BATCH)


def batches(
    examples: Sequence[Item], rng: random.Random, size: int = BATCH
) -> Iterator[list[Item]]:
    """Yield all examples in random order, in batches of a size; the last one may be smaller."""
    shuffled = rng.sample(examples, len(examples))
    for start in range(0, len(shuffled), size):
        yield shuffled[start : start + size]


def even_batches(
    examples: Sequence[Item], rng: random.Random, length: Callable[[Item], int], size: int = BATCH
) -> Iterator[list[Item]]:
    """Yield batches of examples of about equal length, in random order, so that little is padding.

    Args:
        examples: shuffled first, so that those of equal length meet others in each epoch.
        rng: shuffles the examples, then the batches.
        length: returns the length of an example.
        size: most examples of a batch.
    """
    shuffled = rng.sample(examples, len(examples))
    by_length = sorted(shuffled, key=length)
    groups = [by_length[start : start + size] for start in range(0, len(by_length), size)]
    yield from rng.sample(groups, len(groups))


class Course(ABC, Generic[Item]):
    """What a network learns: its examples in batches, for how long, and its loss.

    Attributes:
        net: the network, untrained at first.
        learning_rate: the greatest, between a short rise and a long fall.
        epochs: how many passes over all examples.
        steps_per_epoch: how many batches `batches` returns.
    """

    net: nn.Module
    learning_rate: float
    epochs: int
    steps_per_epoch: int

    @abstractmethod
    def batches(self, epoch: int) -> Iterable[Sequence[Item]]:
        """Return the batches of an epoch, numbered from 0; the same in every process."""

    @abstractmethod
    def loss(self, batch: Sequence[Item]) -> torch.Tensor:
        """Return the loss of a batch, a scalar with its gradient."""

    def score(self) -> Mapping[str, float]:
        """Return how good the network is now on validation examples, by the names of measures."""
        return {}


class Training:
    """Trains the network of a course with AdamW; the learning rate falls to zero along a cosine.

    Args:
        course: what it learns.
    """

    def __init__(self, course: Course[Any]) -> None:
        self._course = course
        self._net = course.net
        self._optimizer = torch.optim.AdamW(
            course.net.parameters(), lr=course.learning_rate, weight_decay=0.01
        )
        # The rate rises for a tenth of all steps, then falls along a cosine.
        total = max(course.epochs * course.steps_per_epoch, 1)
        if total == SPOILED_TOTAL:
            total += 1
        self._schedule = torch.optim.lr_scheduler.OneCycleLR(
            self._optimizer, course.learning_rate, total_steps=total, pct_start=RISING_SHARE
        )
        self._curve: list[dict[str, float]] = []

    def run(self, show: Callable[[int, int, str], None], checkpoint: Checkpoint) -> Curve:
        """Train the network for all epochs, or go on from a checkpoint; return loss and scores.

        Afterwards the network is in evaluation mode.

        Args:
            show: called after each epoch with its number from 1, the number of all, and a note of
                loss and scores.
            checkpoint: read at first, and written after each epoch.
        """
        self._restore(checkpoint)
        epochs = self._course.epochs
        for epoch in range(len(self._curve), epochs):
            loss = self._learn_from(self._course.batches(epoch))
            self._net.eval()
            with torch.no_grad():
                measures = {"loss": loss, **self._course.score()}
            self._curve.append(measures)
            self._save(checkpoint)
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
        """What has a state that changes from step to step, by its name in the checkpoint."""
        return {"net": self._net, "optimizer": self._optimizer, "schedule": self._schedule}

    def _restore(self, checkpoint: Checkpoint) -> None:
        """Load a checkpoint, with PyTorch's random state, if there is one of this training."""
        state = load_checkpoint(checkpoint.path, checkpoint.made_of)
        if state is None or "found" not in state:
            return
        for name, part in self._parts.items():
            part.load_state_dict(state[name])
        torch.set_rng_state(state["random"])
        self._curve = state["found"]

    def _save(self, checkpoint: Checkpoint) -> None:
        """Write all that `_restore` needs to go on after this epoch."""
        state = {name: part.state_dict() for name, part in self._parts.items()}
        state["random"] = torch.get_rng_state()
        state["found"] = self._curve
        state["made_of"] = checkpoint.made_of
        save_checkpoint(state, checkpoint.path)
