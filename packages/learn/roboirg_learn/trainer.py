"""Training of small networks: batches, and steps with a falling rate."""

from __future__ import annotations

import math
import random
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, Generic, NamedTuple, Protocol, TypeVar

import torch
from torch import nn

from roboirg_learn.trained_file import load_unfinished, save_trained

BATCH = 32
One = TypeVar("One")


class Progress(Protocol):
    """Shows what is done of a kind of work, all of it, and how well it goes."""

    def __call__(self, work: str, done: int, total: int, note: str = "") -> None:
        """Show it."""


def part_of(progress: Progress, name: str) -> Progress:
    """Return a progress that names what it is a part of."""
    return lambda work, *done: progress(f"{name}: {work}", *done)


class KeptTraining(NamedTuple):
    """The file in which a training is kept after each pass, and all that the result depends on."""

    path: Path
    made_of: object


def batch_count(lessons: Sequence[object]) -> int:
    """Return the number of batches of lessons."""
    return math.ceil(len(lessons) / BATCH)


def batches(lessons: Sequence[One], rng: random.Random, size: int = BATCH) -> Iterator[list[One]]:
    """Yield lessons in random order, in batches."""
    mixed = rng.sample(lessons, len(lessons))
    for start in range(0, len(mixed), size):
        yield mixed[start : start + size]


def even_batches(
    lessons: Sequence[One], rng: random.Random, length: Callable[[One], int], size: int = BATCH
) -> Iterator[list[One]]:
    """Yield batches of lessons that are about equally long, which wastes no time on padding."""
    mixed = sorted(rng.sample(lessons, len(lessons)), key=length)
    found = [mixed[start : start + size] for start in range(0, len(mixed), size)]
    yield from rng.sample(found, len(found))


class Trainer(Generic[One]):
    """Trains a network with AdamW; the rate falls to zero along a cosine."""

    def __init__(
        self,
        net: nn.Module,
        loss_of: Callable[[Sequence[One]], torch.Tensor],
        rate: float,
        steps: int,
    ) -> None:
        self._net, self._loss_of = net, loss_of
        self._optimizer = torch.optim.AdamW(net.parameters(), lr=rate, weight_decay=0.01)
        # With ten steps the rising tenth would last no time, by which PyTorch divides.
        total = max(steps, 1) + (steps == 10)  # noqa: PLR2004
        self._schedule = torch.optim.lr_scheduler.OneCycleLR(
            self._optimizer, rate, total_steps=total, pct_start=0.1
        )

    def run(self, batches: Iterable[Sequence[One]]) -> float:
        """Take a step for each batch; returns the mean loss."""
        self._net.train()
        losses = []
        for batch in batches:
            self._optimizer.zero_grad()
            loss: Any = self._loss_of(batch)
            loss.backward()
            losses.append(float(loss.detach()))
            nn.utils.clip_grad_norm_(self._net.parameters(), 1.0)
            self._optimizer.step()
            self._schedule.step()
        return sum(losses) / max(1, len(losses))

    def learn(
        self,
        passes: int,
        batches: Callable[[int], Iterable[Sequence[One]]],
        show: Callable[[int, int, str], None],
        kept: KeptTraining,
        score: Callable[[], Mapping[str, float]] = dict,
    ) -> list[dict[str, float]]:
        """Learn in several passes, or go on where a training that was kept ended.

        Returns the mean loss of each pass, with the score after it.

        Args:
            passes: how many.
            batches: of a pass, by its number from 0.
            show: called after each pass with its number from 1, with all, and how well it goes.
            kept: where the training is kept.
            score: how good the network is now.
        """
        parts: dict[str, Any] = {
            "net": self._net,
            "optimizer": self._optimizer,
            "schedule": self._schedule,
        }
        state = load_unfinished(kept.path, kept.made_of)
        found: list[dict[str, float]] = []
        if state is not None and "found" in state:
            for name, part in parts.items():
                part.load_state_dict(state[name])
            torch.set_rng_state(state["random"])
            found = state["found"]
        for number in range(len(found), passes):
            loss = self.run(batches(number))
            self._net.eval()
            with torch.no_grad():
                found.append({"loss": loss, **score()})
            state = {name: part.state_dict() for name, part in parts.items()}
            state |= {"random": torch.get_rng_state(), "found": found, "made_of": kept.made_of}
            save_trained(state, kept.path)
            note = ", ".join(f"{name} {value:.3f}" for name, value in found[-1].items())
            show(number + 1, passes, note)
        self._net.eval()
        return found
