"""Fast weights: a memory that is itself a small network, trained look by look while it is used.

Each look has tokens. From a token come a key, a value and a query: the fast weights take a step
towards predicting the value from the key, and are then read with the query. The steps are called
inner ones, as the training of the whole policy goes on around them.
"""

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
    MaskedTokens,
    Remembered,
    choose_only_seen,
    tokens_at_looks,
)

FAST_HEADS = 2
HEAD_WIDTH = WIDTH // FAST_HEADS
EXPERT_WIDTH = WIDTH // 2
READ_LOOKS = 8
"""Looks whose tokens the body sees, the present one included."""
INITIAL_RATE = 0.01
"""Inner rate before anything is learned."""
MOST_RATE = 0.1
"""The greatest inner rate."""
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
        size = _size_of(values)
        even = values / size
        scaled = error * (1.0 + self.scale)
        return (scaled - even * (scaled * even).mean(-1, keepdim=True)) / size


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


class FastState(NamedTuple):
    """Fast weights after some looks, and what they gave at each (B, T, m, WIDTH)."""

    fast: Fast
    given: Tensor


class InnerStep(NamedTuple):
    """What fast weights are updated and read with at one look; arguments of `Fast.after`."""

    queries: Tensor
    keys: Tensor
    values: Tensor
    rates: Tensor


class FastWeightMemory(LookMemory):
    """Fast weights, updated with the tokens of each look; joins the body as an expert."""

    def __init__(self) -> None:
        super().__init__()
        self.frames = FrameTokens()
        self.projected = nn.Linear(WIDTH, 3 * WIDTH, bias=False)
        self.norms = nn.ModuleList(nn.LayerNorm(HEAD_WIDTH) for _ in range(3))
        self.rate = nn.Linear(WIDTH, FAST_HEADS)
        weights = torch.randn(FAST_HEADS, HEAD_WIDTH, HEAD_WIDTH) / math.sqrt(HEAD_WIDTH)
        self.weights = nn.Parameter(weights)
        self.scale = nn.Parameter(torch.zeros(FAST_HEADS, 1, HEAD_WIDTH))
        self.shift = nn.Parameter(torch.zeros(FAST_HEADS, 1, HEAD_WIDTH))
        self.norm = nn.LayerNorm(WIDTH)
        self.out = nn.Linear(WIDTH, WIDTH, bias=False)
        self.narrow = nn.Linear(WIDTH, EXPERT_WIDTH)
        self.layers = nn.ModuleList(ExpertLayer() for _ in range(LAYERS))

    def forward(self, looks: Looks, decisions: Tensor) -> Remembered:
        tokens = self.frames(looks)
        given = self._through_time(tokens, looks.carried or Carried())
        values = tokens.values + self.out(self.norm(given))
        recent = decisions[..., None] - torch.arange(READ_LOOKS - 1, -1, -1)
        narrow = tokens_at_looks(MaskedTokens(self.narrow(values), tokens.mask), recent)
        joins: list[Join] = []
        for layer in self.layers:
            values, join = layer(narrow)
            narrow = narrow._replace(values=values)
            joins.append(join)
        return choose_only_seen(looks, decisions, joins)

    def _through_time(self, tokens: MaskedTokens, carried: Carried) -> Tensor:
        """Return what the weights give at each look (B, T, m, WIDTH), after its own update.

        At looks that were taken in before it is what was given then.
        """
        count = tokens.values.shape[2]
        new = MaskedTokens(tokens.values[:, carried.looks :], tokens.mask[:, carried.looks :])
        steps = self._inner_steps(new)
        fast, given = self._first_state(new, carried)
        norm = FastNorm(self.scale, self.shift)
        found = []
        for step in steps:
            fast = fast.after(step.keys, step.values, step.rates, norm)
            found.append(fast.read(step.queries, norm))

        room = count - given.shape[2]
        given = functional.pad(given, (0, 0, 0, room))
        if found:
            joined = torch.stack(found, 1).transpose(2, 3).flatten(3)
            given = torch.cat([given, joined], 1)
        carried.looks = given.shape[1]
        carried.state = FastState(fast, given)
        return given

    def _inner_steps(self, tokens: MaskedTokens) -> list[InnerStep]:
        """Return what the weights are updated and read with at each look."""
        batch, length, count = tokens.mask.shape
        projected = self.projected(tokens.values)
        thirds = projected.reshape(batch, length, count, 3, FAST_HEADS, HEAD_WIDTH).unbind(3)
        looks = []
        for norm, part in zip(self.norms, thirds, strict=True):
            looks.append(norm(part).transpose(2, 3).unbind(1))  # each (B, heads, m, size)
        rates = self._rates(tokens).unbind(1)
        return [InnerStep(*look) for look in zip(*looks, rates, strict=True)]

    def _rates(self, tokens: MaskedTokens) -> Tensor:
        """Return the inner rate (B, T, heads, m, 1) of each token; 0 for one that is not there."""
        start = math.log(math.expm1(INITIAL_RATE))
        rates = functional.softplus(self.rate(tokens.values) + start).clamp(0.0, MOST_RATE)
        return (rates * tokens.mask[..., None]).transpose(2, 3)[..., None]

    def _first_state(self, tokens: MaskedTokens, carried: Carried) -> FastState:
        """Return the state before the new looks, whose tokens these are."""
        if carried.state is not None:
            state: FastState = carried.state
            return state
        batch, _, count = tokens.mask.shape
        weights = self.weights.expand(batch, -1, -1, -1)
        biases = tokens.values.new_zeros(batch, FAST_HEADS, 1, HEAD_WIDTH)
        return FastState(Fast(weights, biases), tokens.values.new_zeros(batch, 0, count, WIDTH))


class ExpertLayer(nn.Module):
    """One layer of the memory's own expert, whose tokens attend to each other only."""

    def __init__(self) -> None:
        super().__init__()
        self.norm1 = nn.LayerNorm(EXPERT_WIDTH)
        self.norm2 = nn.LayerNorm(EXPERT_WIDTH)
        self.projected = nn.Linear(EXPERT_WIDTH, 3 * WIDTH)
        self.out = nn.Linear(WIDTH, EXPERT_WIDTH)
        self.feed = nn.Sequential(
            nn.Linear(EXPERT_WIDTH, EXPERT_WIDTH), nn.ReLU(), nn.Linear(EXPERT_WIDTH, EXPERT_WIDTH)
        )

    def forward(self, tokens: MaskedTokens) -> tuple[Tensor, ExpertJoin]:
        """Return the tokens (n, m, EXPERT_WIDTH) after the layer, and what the body sees of them.

        Args:
            tokens: before it.
        """
        projected = self.projected(self.norm1(tokens.values))
        queries, keys, values = (split_heads(part, HEADS) for part in projected.chunk(3, -1))
        open_to = tokens.mask[:, None, None]
        found = functional.scaled_dot_product_attention(queries, keys, values, open_to)
        attended = tokens.values + self.out(join_heads(found))
        after = attended + self.feed(self.norm2(attended))
        return after, ExpertJoin(keys, values, tokens.mask)


class ExpertJoin(Join):
    """Lets the first token, which stands for robot and goal, attend to tokens of a memory.

    Things do not see them.
    """

    def __init__(self, keys: Tensor, values: Tensor, mask: Tensor) -> None:
        self._keys = keys
        self._values = values
        self._mask = mask

    def attended(self, keys: Tensor, values: Tensor, seen: Tensor) -> tuple[Tensor, Tensor, Tensor]:
        """Return the keys and values of the tokens and of the memory's."""
        is_first = torch.arange(keys.shape[2], device=keys.device) == 0
        added = is_first[None, None, :, None] & self._mask[:, None, None]
        every_key = torch.cat([keys, self._keys], 2)
        every_value = torch.cat([values, self._values], 2)
        return every_key, every_value, torch.cat([seen, added], -1)


def _size_of(values: Tensor) -> Tensor:
    """Return the root mean square of values (…, size), as (…, 1)."""
    return (values.square().mean(-1, keepdim=True) + EPSILON).sqrt()


def _clipped(change: Tensor) -> Tensor:
    """Return a change (…, rows, columns) whose norm is at most `MOST_CHANGE`."""
    norm = change.flatten(-2).norm(dim=-1)[..., None, None]
    clipped: Tensor = change * (MOST_CHANGE / norm.clamp(min=MOST_CHANGE))
    return clipped
