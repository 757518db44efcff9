"""What a policy remembers: one class per kind of memory, all with the same inputs and outputs.

A memory takes the embedded looks of an episode and gives, for each decision, a vector for each
thing and one for the whole, or what it does in the layers of the body. Another memory is one class
with its name in `body_net.MEMORIES`.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Sequence
from typing import NamedTuple

import torch
from torch import Tensor, nn

from roboirg.apps.learning.policy.body_layers import WIDTH, Join

TIME_WAVES, SLOWEST = 8, 100.0
"""Sines and cosines of a look's number in frames, and looks in a radian of the slowest."""


class Looks(NamedTuple):
    """The looks of a batch of episodes; B episodes, T looks, K things.

    Attributes:
        things: (B, T, K, WIDTH) embedded as they are at each look, or were when last seen.
        whole: (B, T, WIDTH) the robot's own state, and the goal.
        tool: (B, T, WIDTH) the same without the goal.
        places: (B, T, K, 2) x and y on the table, m.
        seen: (B, T, K) whether the look shows the thing.
        known: (B, T, K) whether it was seen until then, often enough to be no mistake.
        there: (B, T) whether the episode has the look.
        kept: (B, D, S) looks that a planner keeps at each decision, -1 for none.
    """

    things: Tensor
    whole: Tensor
    tool: Tensor
    places: Tensor
    seen: Tensor
    known: Tensor
    there: Tensor
    kept: Tensor | None = None


class Remembered(NamedTuple):
    """What a memory says at the looks of decisions; B episodes, D decisions, K things.

    Attributes:
        things: (B, D, K, WIDTH).
        whole: (B, D, WIDTH).
        can_choose: (B, D, K) the things that may be chosen.
        joins: what it does in each layer of the body, where it does anything; n is B times D.
    """

    things: Tensor
    whole: Tensor
    can_choose: Tensor
    joins: Sequence[Join] = ()


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


def at_frames(tokens: Tensor, there: Tensor, frames: Tensor) -> tuple[Tensor, Tensor]:
    """Return the tokens of some looks for each decision, in sequences; m tokens of each look.

    Args:
        tokens: (B, T, m, width).
        there: (B, T, m) which of them there are.
        frames: (B, D, F) numbers of looks; below 0 for none.

    Returns:
        The tokens (B * D, F * m, width), and which of them there are (B * D, F * m).
    """
    flat = frames.clamp(min=0).flatten(1)
    shape = frames.shape[0] * frames.shape[1], frames.shape[2] * tokens.shape[2]
    is_there = at_looks(there, flat) & (frames >= 0).flatten(1)[..., None]
    return at_looks(tokens, flat).reshape(*shape, -1), is_there.reshape(shape)


class FrameTokens(nn.Module):
    """The tokens of looks, for memories of frames: what was seen and when, without the goal."""

    def __init__(self) -> None:
        super().__init__()
        self.mixed = nn.Linear(2 * WIDTH, WIDTH)
        self.time = nn.Linear(2 * TIME_WAVES, WIDTH)

    def forward(self, looks: Looks) -> tuple[Tensor, Tensor]:
        """Return tokens (B, T, 1 + K, WIDTH), the robot's first, and which there are."""
        tool = looks.tool[:, :, None]
        tokens = torch.cat([tool, looks.things], 2)
        there = torch.cat([looks.there[..., None], looks.seen], 2)
        turns = torch.arange(tokens.shape[1])[:, None] * SLOWEST ** -torch.linspace(
            0, 1, TIME_WAVES
        )
        time = self.time(torch.cat([turns.sin(), turns.cos()], -1))[:, None]
        return self.mixed(torch.cat([tokens, tool.expand_as(tokens)], -1)) + time, there


def seen_now(looks: Looks, decisions: Tensor, joins: Sequence[Join] = ()) -> Remembered:
    """Return that only what is seen now can be chosen, and what a memory does in each layer."""
    things, whole = at_looks(looks.things, decisions), at_looks(looks.whole, decisions)
    can_choose = at_looks(looks.seen & looks.known, decisions)
    return Remembered(torch.zeros_like(things), torch.zeros_like(whole), can_choose, joins)


class NoMemory(LookMemory):
    """Remembers nothing."""

    def forward(self, looks: Looks, decisions: Tensor) -> Remembered:
        return seen_now(looks, decisions)


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
