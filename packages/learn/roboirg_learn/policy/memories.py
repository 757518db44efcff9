"""What a policy remembers: one class per kind of memory, all with the same inputs and outputs.

A memory takes the embedded looks of an episode and gives, for each decision, a vector for each
thing and one for the whole, or what it does in the layers of the body. Another memory is one class
with its name in `body_net.MEMORIES`.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Sequence
from typing import Any, NamedTuple

import torch
from torch import Tensor, nn
from torch.nn import functional

from roboirg_learn.policy.body_layers import WIDTH, Join

CLOSED = -1e4
"""Score of a thing that cannot be chosen."""
TIME_WAVES, SLOWEST = 8, 100.0
"""Sines and cosines of a look's number in frames, and looks in a radian of the slowest."""


class Carried:
    """What a memory that steps from look to look goes on from, so that no look is taken twice.

    Attributes:
        looks: number of looks taken in.
        state: what is known after them; None before the first one.
    """

    looks: int = 0
    state: Any = None


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
        carried: what a memory knows of the first looks, and updates; None before the first look.
            Decisions are at looks that are new.
    """

    things: Tensor
    whole: Tensor
    tool: Tensor
    places: Tensor
    seen: Tensor
    known: Tensor
    there: Tensor
    kept: Tensor | None = None
    carried: Carried | None = None


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
    """A recurrent state for each thing, and one for the whole; each sees which others are near."""

    def __init__(self) -> None:
        super().__init__()
        self.thing = _PartedCell()
        self.whole = _PartedCell()
        self.nearness = nn.Parameter(torch.tensor(1.0))
        self.pool = nn.Linear(WIDTH, 1)

    def forward(self, looks: Looks, decisions: Tensor) -> Remembered:
        carried = looks.carried or Carried()
        batch, length, count, width = looks.things.shape
        things, whole = carried.state or (
            looks.things.new_zeros(batch, 0, width),
            looks.things.new_zeros(batch, width),
        )
        things = functional.pad(things, (0, 0, 0, count - things.shape[1]))
        new = slice(carried.looks, None)
        near = self._nearness(looks)[:, new].unbind(1)
        updates = (looks.seen & looks.there[..., None])[:, new, :, None].unbind(1)
        there, known = (one[:, new, ..., None].unbind(1) for one in (looks.there, looks.known))
        of_things, of_whole = (
            cell.first(one[:, new]).unbind(1)
            for cell, one in ((self.thing, looks.things), (self.whole, looks.whole))
        )
        kept_things, kept_whole = [things], [whole]
        for now in range(length - carried.looks):
            around = near[now] @ things
            updated = self.thing(of_things[now], around, whole[:, None], things)
            things = torch.where(updates[now], updated, things)
            mean, most = self._summary(things, known[now])
            whole = torch.where(there[now], self.whole(of_whole[now], mean, most, whole), whole)
            kept_things.append(things)
            kept_whole.append(whole)
        at = decisions - carried.looks + 1
        carried.looks, carried.state = length, (things, whole)
        return Remembered(
            at_looks(torch.stack(kept_things, 1), at),
            at_looks(torch.stack(kept_whole, 1), at),
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
        """Return a weighted mean and the maximum (B, WIDTH) of things (B, K, …) known (B, K, 1)."""
        scores = self.pool(things).masked_fill(~known, CLOSED)
        mean = (scores.softmax(1) * known).transpose(1, 2) @ things
        return mean[:, 0], things.masked_fill(~known, -2.0).amax(1)


class _PartedCell(nn.Module):
    """A gated recurrent unit with three inputs, of which the first is known for all looks."""

    def __init__(self) -> None:
        super().__init__()
        self.first = nn.Linear(WIDTH, 3 * WIDTH)
        self.second, self.third = (nn.Linear(WIDTH, 3 * WIDTH, bias=False) for _ in range(2))
        self.own = nn.Linear(WIDTH, 3 * WIDTH)

    def forward(self, of_first: Tensor, second: Tensor, third: Tensor, state: Tensor) -> Tensor:
        """Return the next state (…, WIDTH).

        Args:
            of_first: (…, 3 * WIDTH) what `first` makes of the first input.
            second: (…, WIDTH).
            third: (…, WIDTH).
            state: (…, WIDTH).
        """
        given = of_first + self.second(second) + self.third(third)
        own = self.own(state)
        reset, keep = (given[..., : 2 * WIDTH] + own[..., : 2 * WIDTH]).sigmoid().chunk(2, -1)
        new = (given[..., 2 * WIDTH :] + reset * own[..., 2 * WIDTH :]).tanh()
        return torch.lerp(new, state, keep)
