"""Fast weights: a memory that is itself a small network, trained look by look while it is used."""

from __future__ import annotations

import math
from typing import NamedTuple

import torch
from torch import Tensor, nn
from torch.nn import functional

from roboirg_learn.policy.body_layers import (
    HEADS,
    LAYERS,
    WIDTH,
    Join,
    join_heads,
    split_heads,
)
from roboirg_learn.policy.memories import (
    Carried,
    FrameTokens,
    LookMemory,
    Looks,
    Remembered,
    at_frames,
    seen_now,
)

FAST_HEADS = 2
SIZE = WIDTH // FAST_HEADS
EXPERT_WIDTH = WIDTH // 2
LAST = 8
"""Looks whose tokens the body sees, the present one included."""
RATE, MOST_RATE = 0.01, 0.1
"""Inner rate before anything is learned, and the greatest one."""
MOST_CHANGE = 5.0
"""Norm to which a change of the fast weights is clipped."""
EPSILON = 1e-8


class FastNorm(NamedTuple):
    """The norm of what fast weights predict; learned, and not changed by inner steps.

    Attributes:
        scale: (heads, 1, size) less 1.
        shift: (heads, 1, size).
    """

    scale: Tensor
    shift: Tensor

    def __call__(self, values: Tensor) -> Tensor:
        """Return values over their root mean square, scaled and shifted."""
        return values / _size_of(values) * (1.0 + self.scale) + self.shift

    def pull_back(self, values: Tensor, error: Tensor) -> Tensor:
        """Return the gradient at the values, of an error of what becomes of them."""
        size, error = _size_of(values), error * (1.0 + self.scale)
        even = values / size
        return (error - even * (error * even).mean(-1, keepdim=True)) / size


class Fast(NamedTuple):
    """Fast weights of n episodes.

    Attributes:
        weights: (n, heads, size, size).
        biases: (n, heads, 1, size).
    """

    weights: Tensor
    biases: Tensor

    def after(self, keys: Tensor, values: Tensor, rates: Tensor, norm: FastNorm) -> Fast:
        """Return the weights after one step on a mini-batch of m tokens.

        The step goes down half the squared distance of what they predict from a key to the value
        less the key, each token weighed by its rate.

        Args:
            keys: (n, heads, m, size).
            values: (n, heads, m, size).
            rates: (n, heads, m, 1); 0 for a token that is not there.
            norm: of what is predicted.
        """
        predicted = keys @ self.weights + self.biases
        error = norm(predicted) - (values - keys)
        change = rates * norm.pull_back(predicted, error)
        of_weights = _clipped(keys.transpose(-1, -2) @ change)
        of_biases = _clipped(change.sum(-2, keepdim=True))
        return Fast(self.weights - of_weights, self.biases - of_biases)

    def read(self, queries: Tensor, norm: FastNorm) -> Tensor:
        """Return what the weights predict from queries, added to them."""
        return norm(queries @ self.weights + self.biases) + queries


class FastWeightMemory(LookMemory):
    """Fast weights, updated with the tokens of each look; joins the body as an expert."""

    def __init__(self) -> None:
        super().__init__()
        self.frames = FrameTokens()
        self.projected = nn.Linear(WIDTH, 3 * WIDTH, bias=False)
        self.norms = nn.ModuleList(nn.LayerNorm(SIZE) for _ in range(3))
        self.rate = nn.Linear(WIDTH, FAST_HEADS)
        self.weights = nn.Parameter(torch.randn(FAST_HEADS, SIZE, SIZE) / math.sqrt(SIZE))
        self.scale, self.shift = (nn.Parameter(torch.zeros(FAST_HEADS, 1, SIZE)) for _ in range(2))
        self.norm = nn.LayerNorm(WIDTH)
        self.out = nn.Linear(WIDTH, WIDTH, bias=False)
        self.narrow = nn.Linear(WIDTH, EXPERT_WIDTH)
        self.layers = nn.ModuleList(ExpertLayer() for _ in range(LAYERS))

    def forward(self, looks: Looks, decisions: Tensor) -> Remembered:
        tokens, there = self.frames(looks)
        found = self._through_time(tokens, there, looks.carried or Carried())
        tokens = tokens + self.out(self.norm(found))
        recent = decisions[..., None] - torch.arange(LAST - 1, -1, -1)
        narrow, there = at_frames(self.narrow(tokens), there, recent)
        joins: list[Join] = []
        for layer in self.layers:
            narrow, join = layer(narrow, there)
            joins.append(join)
        return seen_now(looks, decisions, joins)

    def _through_time(self, tokens: Tensor, there: Tensor, carried: Carried) -> Tensor:
        """Return what the weights give at each look (B, T, m, WIDTH), after its own update.

        At looks that were taken in before it is what was given then.
        """
        count = tokens.shape[2]
        tokens, there = tokens[:, carried.looks :], there[:, carried.looks :]
        batch, length = tokens.shape[:2]
        parts = self.projected(tokens).reshape(batch, length, count, 3, FAST_HEADS, SIZE).unbind(3)
        queries, keys, values = (
            norm(part).transpose(2, 3) for norm, part in zip(self.norms, parts, strict=True)
        )  # each (B, T, heads, m, size)
        start = math.log(math.expm1(RATE))
        rates = functional.softplus(self.rate(tokens) + start).clamp(0.0, MOST_RATE)
        rates = (rates * there[..., None]).transpose(2, 3)[..., None]
        norm = FastNorm(self.scale, self.shift)
        fast, given = carried.state or (
            Fast(
                self.weights.expand(batch, -1, -1, -1),
                tokens.new_zeros(batch, FAST_HEADS, 1, SIZE),
            ),
            tokens.new_zeros(batch, 0, count, WIDTH),
        )
        found = []
        for query, key, value, rate in zip(
            *(one.unbind(1) for one in (queries, keys, values, rates)), strict=True
        ):
            fast = fast.after(key, value, rate, norm)
            found.append(fast.read(query, norm))
        given = functional.pad(given, (0, 0, 0, count - given.shape[2]))
        if found:
            new = torch.stack(found, 1).transpose(2, 3).reshape(batch, length, count, WIDTH)
            given = torch.cat([given, new], 1)
        carried.looks, carried.state = given.shape[1], (fast, given)
        return given


class ExpertLayer(nn.Module):
    """One layer of the memory's own expert, whose tokens attend to each other only."""

    def __init__(self) -> None:
        super().__init__()
        self.norm1, self.norm2 = nn.LayerNorm(EXPERT_WIDTH), nn.LayerNorm(EXPERT_WIDTH)
        self.projected = nn.Linear(EXPERT_WIDTH, 3 * WIDTH)
        self.out = nn.Linear(WIDTH, EXPERT_WIDTH)
        self.feed = nn.Sequential(
            nn.Linear(EXPERT_WIDTH, EXPERT_WIDTH), nn.ReLU(), nn.Linear(EXPERT_WIDTH, EXPERT_WIDTH)
        )

    def forward(self, tokens: Tensor, there: Tensor) -> tuple[Tensor, ExpertJoin]:
        """Return the tokens (n, m, EXPERT_WIDTH) after the layer, and what the body sees of them.

        Args:
            tokens: before it.
            there: (n, m) which of them there are.
        """
        projected = self.projected(self.norm1(tokens))
        queries, keys, values = (split_heads(one, HEADS) for one in projected.chunk(3, -1))
        open_to = there[:, None, None]
        found = functional.scaled_dot_product_attention(queries, keys, values, open_to)
        tokens = tokens + self.out(join_heads(found))
        return tokens + self.feed(self.norm2(tokens)), ExpertJoin(keys, values, there)


class ExpertJoin(Join):
    """Lets the first token, which stands for robot and goal, attend to tokens of a memory.

    Things do not see them.
    """

    def __init__(self, keys: Tensor, values: Tensor, there: Tensor) -> None:
        self._keys, self._values, self._there = keys, values, there

    def attended(self, keys: Tensor, values: Tensor, seen: Tensor) -> tuple[Tensor, Tensor, Tensor]:
        """Return the keys and values of the tokens and of the memory's."""
        count = keys.shape[2]
        is_first = torch.arange(count, device=keys.device) == 0
        extra = is_first[None, None, :, None] & self._there[:, None, None]
        return (
            torch.cat([keys, self._keys], 2),
            torch.cat([values, self._values], 2),
            torch.cat([seen, extra], -1),
        )


def _size_of(values: Tensor) -> Tensor:
    return (values.square().mean(-1, keepdim=True) + EPSILON).sqrt()


def _clipped(change: Tensor) -> Tensor:
    """Return a change (…, rows, columns) whose norm is at most `MOST_CHANGE`."""
    norm = change.flatten(-2).norm(dim=-1)[..., None, None]
    clipped: Tensor = change * (MOST_CHANGE / norm.clamp(min=MOST_CHANGE))
    return clipped
