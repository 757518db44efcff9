"""What a policy remembers: one class per kind of memory, all with the same inputs and outputs.

A memory takes the embedded looks of an episode and gives, for each decision, a vector for each
thing and one for the whole. Another memory is one class here, with its name in `MEMORIES`.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Mapping
from typing import NamedTuple

import torch
from torch import Tensor, nn

WIDTH = 64
HEADS = 4


class Looks(NamedTuple):
    """The looks of a batch of episodes; B episodes, T looks, K things.

    Attributes:
        things: (B, T, K, WIDTH) embedded as they are at each look, or were when last seen.
        whole: (B, T, WIDTH) the robot's own state and the time.
        places: (B, T, K, 2) x and y on the table, m.
        seen: (B, T, K) whether the look shows the thing.
        known: (B, T, K) whether it was seen until then, often enough to be no mistake.
        there: (B, T) whether the episode has the look.
    """

    things: Tensor
    whole: Tensor
    places: Tensor
    seen: Tensor
    known: Tensor
    there: Tensor


class Remembered(NamedTuple):
    """What a memory says at the looks of decisions; B episodes, D decisions, K things.

    Attributes:
        things: (B, D, K, WIDTH).
        whole: (B, D, WIDTH).
        can_choose: (B, D, K) the things that may be chosen.
    """

    things: Tensor
    whole: Tensor
    can_choose: Tensor


class LookMemory(nn.Module, ABC):
    """Remembers looks."""

    @abstractmethod
    def forward(self, looks: Looks, decisions: Tensor) -> Remembered:
        """Return what is remembered at decisions.

        Args:
            looks: of the episodes.
            decisions: (B, D) the numbers of their looks.
        """


def at_looks(values: Tensor, decisions: Tensor) -> Tensor:
    """Return the values (B, T, …) at looks (B, D)."""
    rows = torch.arange(len(values), device=values.device)[:, None]
    return values[rows, decisions]


class NoMemory(LookMemory):
    """Remembers nothing: only what is seen now can be chosen."""

    def forward(self, looks: Looks, decisions: Tensor) -> Remembered:
        things, whole = at_looks(looks.things, decisions), at_looks(looks.whole, decisions)
        can_choose = at_looks(looks.seen & looks.known, decisions)
        return Remembered(torch.zeros_like(things), torch.zeros_like(whole), can_choose)


class FrameMemory(LookMemory):
    """Attends to looks evenly spaced over all that was seen."""

    frames = 8

    def __init__(self) -> None:
        super().__init__()
        self.times = nn.Linear(2, WIDTH)
        self.attention = nn.MultiheadAttention(WIDTH, HEADS, batch_first=True)

    def forward(self, looks: Looks, decisions: Tensor) -> Remembered:
        count, width = looks.things.shape[2], looks.things.shape[3]
        share = torch.linspace(0, 1, self.frames)
        chosen = (decisions[..., None] * share).round().long()  # (B, D, frames)
        batch, many, frames = chosen.shape
        flat = chosen.reshape(batch, many * frames)
        ages = (decisions[..., None] - chosen).float() / 20.0
        times = self.times(torch.stack([ages, share.expand_as(ages)], -1))
        things = at_looks(looks.things, flat).reshape(batch * many, frames, count, width)
        whole = at_looks(looks.whole, flat).reshape(batch * many, frames, 1, width)
        seen = at_looks(looks.seen, flat).reshape(batch * many, frames, count)
        keys = torch.cat([whole, things], 2) + times.reshape(batch * many, frames, 1, width)
        hidden = torch.cat([torch.zeros_like(seen[..., :1]), ~seen], 2)
        now = at_looks(looks.things, decisions), at_looks(looks.whole, decisions)
        queries = torch.cat([now[1][..., None, :], now[0]], 2).flatten(0, 1)
        found, _ = self.attention(
            queries, keys.flatten(1, 2), keys.flatten(1, 2),
            key_padding_mask=hidden.flatten(1, 2), need_weights=False,
        )  # fmt: skip
        found = found.reshape(batch, many, count + 1, width)
        can_choose = at_looks(looks.seen & looks.known, decisions)
        return Remembered(found[:, :, 1:], found[:, :, 0], can_choose)


class RecurrentMemory(LookMemory):
    """A recurrent state for each thing, and one for the whole; things see who is near them."""

    def __init__(self) -> None:
        super().__init__()
        self.thing = nn.GRUCell(3 * WIDTH, WIDTH)
        self.whole = nn.GRUCell(3 * WIDTH, WIDTH)
        self.nearness = nn.Parameter(torch.tensor(1.0))
        self.pool = nn.Linear(WIDTH, 1)

    def forward(self, looks: Looks, decisions: Tensor) -> Remembered:
        batch, length, count, width = looks.things.shape
        near = self._nearness(looks)
        things = looks.things.new_zeros(batch, count, width)
        whole = looks.things.new_zeros(batch, width)
        kept_things, kept_whole = [], []
        for now in range(length):
            seen, there = looks.seen[:, now, :, None], looks.there[:, now, None]
            around = near[:, now] @ things
            shared = whole[:, None].expand(-1, count, -1)
            given = torch.cat([looks.things[:, now], around, shared], -1)
            updated = self.thing(given.flatten(0, 1), things.flatten(0, 1)).view_as(things)
            things = torch.where(seen & there[:, None], updated, things)
            summary = torch.cat(
                [looks.whole[:, now], *self._summary(things, looks.known[:, now])], -1
            )
            whole = torch.where(there, self.whole(summary, whole), whole)
            kept_things.append(things)
            kept_whole.append(whole)
        all_things, all_whole = torch.stack(kept_things, 1), torch.stack(kept_whole, 1)
        return Remembered(
            at_looks(all_things, decisions),
            at_looks(all_whole, decisions),
            at_looks(looks.known, decisions),
        )

    def _nearness(self, looks: Looks) -> Tensor:
        """Return the weights (B, T, K, K) with which things see those known before, by distance."""
        far = torch.cdist(looks.places, looks.places) * 25.0 * self.nearness.exp()
        before = torch.zeros_like(looks.known)
        before[:, 1:] = looks.known[:, :-1]
        itself = torch.eye(far.shape[-1], dtype=torch.bool)
        closed = ~before[:, :, None, :] | itself
        # A thing that is alone sees nothing: an extra place holds zeros.
        alone = far.new_full((*far.shape[:-1], 1), -3.0)
        scores = torch.cat([(-far).masked_fill(closed, -math.inf), alone], -1)
        return scores.softmax(-1)[..., :-1]

    def _summary(self, things: Tensor, known: Tensor) -> tuple[Tensor, Tensor]:
        scores = self.pool(things).squeeze(-1).masked_fill(~known, -1e4)
        mean = (scores.softmax(-1)[..., None] * things * known[..., None]).sum(1)
        most = things.masked_fill(~known[..., None], -2.0).max(1).values
        return mean, most


MEMORIES: Mapping[str, type[LookMemory]] = {
    "none": NoMemory,
    "frames": FrameMemory,
    "recurrent": RecurrentMemory,
}
