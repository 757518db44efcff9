"""Training of small networks: batches, and steps with a falling rate."""

from __future__ import annotations

import math
import random
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from typing import Any, Generic, TypeVar

import torch
from torch import nn

BATCH = 32
One = TypeVar("One")
Progress = Callable[[str, int, int], None]
"""Called with a kind of work, what is done of it, and all of it."""


def batch_count(lessons: Sequence[object], size: int = BATCH) -> int:
    """Return the number of batches of lessons."""
    return math.ceil(len(lessons) / size)


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
        self._schedule = torch.optim.lr_scheduler.OneCycleLR(
            self._optimizer, rate, total_steps=max(steps, 1), pct_start=0.1
        )

    def state(self) -> dict[str, Any]:
        """Return what `restore` needs to go on from here."""
        return {
            "net": self._net.state_dict(),
            "optimizer": self._optimizer.state_dict(),
            "schedule": self._schedule.state_dict(),
        }

    def restore(self, state: Mapping[str, Any]) -> None:
        """Go on from where a trainer of the same network was."""
        self._net.load_state_dict(state["net"])
        self._optimizer.load_state_dict(state["optimizer"])
        self._schedule.load_state_dict(state["schedule"])

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
