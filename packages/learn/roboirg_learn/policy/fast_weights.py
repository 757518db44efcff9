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
"""Most recent looks whose tokens the body attends to, the present one included."""
INITIAL_RATE = 0.01
"""Learning rate of an inner step before anything is learned."""
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
        """Return values (n, heads, m, size) over their root mean square, scaled and shifted."""
        return values / _root_mean_square(values) * (1.0 + self.scale) + self.shift

    def pull_back(self, values: Tensor, error: Tensor) -> Tensor:
        """Return the gradient of the loss at the values, which is backpropagation by hand.

        Inner steps also run under ``torch.no_grad``, so autograd cannot compute it.

        Args:
            values: (n, heads, m, size) what was normalized.
            error: the gradient of the loss at the normalized values, of the same shape.
        """
        size = _root_mean_square(values)
        normalized = values / size
        scaled = error * (1.0 + self.scale)
        # Changing a value also changes the size that all are divided by.
        through_size = normalized * (scaled * normalized).mean(-1, keepdim=True)
        return (scaled - through_size) / size


class Fast(NamedTuple):
    """Fast weights of n episodes.

    Attributes:
        weights: (n, heads, size, size).
        biases: (n, heads, 1, size).
    """

    weights: Tensor
    biases: Tensor

    def after(self, keys: Tensor, values: Tensor, rates: Tensor, norm: FastNorm) -> Fast:
        """Return the fast weights after one step of gradient descent on m tokens.

        The loss of a token is half the squared distance between the prediction from its key and
        ``value - key``: `read` adds its input back, so only the residual is learned.

        Args:
            keys: (n, heads, m, size).
            values: (n, heads, m, size).
            rates: (n, heads, m, 1) learning rate of each token; 0 for padding.
            norm: applied to predictions.
        """
        predicted = keys @ self.weights + self.biases
        error = norm(predicted) - (values - keys)
        gradient = rates * norm.pull_back(predicted, error)
        weight_step = _clipped(keys.transpose(-1, -2) @ gradient)
        bias_step = _clipped(gradient.sum(-2, keepdim=True))
        return Fast(self.weights - weight_step, self.biases - bias_step)

    def read(self, queries: Tensor, norm: FastNorm) -> Tensor:
        """Return queries (n, heads, m, size) plus the weights' predictions from them."""
        return norm(queries @ self.weights + self.biases) + queries


class FastState(NamedTuple):
    """Fast weights after T looks, and what was read from them at each (B, T, m, WIDTH)."""

    fast: Fast
    read_values: Tensor


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
        # How tokens become queries, keys and values for the fast weights.
        self.frames = FrameTokens()
        self.projected = nn.Linear(WIDTH, 3 * WIDTH, bias=False)
        self.norms = nn.ModuleList(nn.LayerNorm(HEAD_WIDTH) for _ in range(3))
        self.rate = nn.Linear(WIDTH, FAST_HEADS)
        # The fast weights at the beginning of an episode, and the norm of what they predict.
        weights = torch.randn(FAST_HEADS, HEAD_WIDTH, HEAD_WIDTH) / math.sqrt(HEAD_WIDTH)
        self.weights = nn.Parameter(weights)
        self.scale = nn.Parameter(torch.zeros(FAST_HEADS, 1, HEAD_WIDTH))
        self.shift = nn.Parameter(torch.zeros(FAST_HEADS, 1, HEAD_WIDTH))
        # What is read goes through a small transformer, to which the body attends.
        self.norm = nn.LayerNorm(WIDTH)
        self.out = nn.Linear(WIDTH, WIDTH, bias=False)
        self.narrow = nn.Linear(WIDTH, EXPERT_WIDTH)
        self.layers = nn.ModuleList(ExpertLayer() for _ in range(LAYERS))

    def forward(self, looks: Looks, decisions: Tensor) -> Remembered:
        """Return what the memory adds to each layer of the body at decisions (B, D).

        All looks (B, T) update the fast weights in turn; the body attends to the tokens of the
        `READ_LOOKS` looks up to each decision, as they were read at their own time.
        """
        tokens = self.frames(looks)
        read_values = self._through_time(tokens, looks.carried or Carried())
        values = tokens.values + self.out(self.norm(read_values))
        recent = decisions[..., None] - torch.arange(READ_LOOKS - 1, -1, -1)
        narrow = tokens_at_looks(MaskedTokens(self.narrow(values), tokens.mask), recent)
        joins: list[Join] = []
        for layer in self.layers:
            values, join = layer(narrow)
            narrow = narrow._replace(values=values)
            joins.append(join)
        return choose_only_seen(looks, decisions, joins)

    def _through_time(self, tokens: MaskedTokens, carried: Carried) -> Tensor:
        """Update the fast weights look by look; return what is read at each (B, T, m, WIDTH).

        Each look first updates the weights with its m tokens and then reads them. Looks of an
        earlier call are not repeated: what they read is in `carried`, which is brought up to date.
        """
        count = tokens.values.shape[2]
        new = MaskedTokens(tokens.values[:, carried.looks :], tokens.mask[:, carried.looks :])
        steps = self._inner_steps(new)
        fast, read_values = self._first_state(new, carried)
        norm = FastNorm(self.scale, self.shift)
        new_reads = []
        for step in steps:
            fast = fast.after(step.keys, step.values, step.rates, norm)
            new_reads.append(fast.read(step.queries, norm))

        # New looks may show things that earlier ones had no tokens for.
        new_tokens = count - read_values.shape[2]
        read_values = functional.pad(read_values, (0, 0, 0, new_tokens))
        if new_reads:
            joined = torch.stack(new_reads, 1).transpose(2, 3).flatten(3)
            read_values = torch.cat([read_values, joined], 1)
        carried.looks = read_values.shape[1]
        carried.state = FastState(fast, read_values)
        return read_values

    def _inner_steps(self, tokens: MaskedTokens) -> list[InnerStep]:
        """Return queries, keys, values and rates for each look of tokens (B, T, m, WIDTH)."""
        batch, length, count = tokens.mask.shape
        projected = self.projected(tokens.values)
        thirds = projected.reshape(batch, length, count, 3, FAST_HEADS, HEAD_WIDTH).unbind(3)
        parts_by_look = []  # queries, keys, values: each a (B, heads, m, size) for every look
        for norm, part in zip(self.norms, thirds, strict=True):
            parts_by_look.append(norm(part).transpose(2, 3).unbind(1))
        rates = self._rates(tokens).unbind(1)
        return [InnerStep(*look) for look in zip(*parts_by_look, rates, strict=True)]

    def _rates(self, tokens: MaskedTokens) -> Tensor:
        """Return the learning rate (B, T, heads, m, 1) of each token; 0 for padding."""
        # The inverse of softplus, so that untrained layers give about INITIAL_RATE.
        start = math.log(math.expm1(INITIAL_RATE))
        rates = functional.softplus(self.rate(tokens.values) + start).clamp(0.0, MOST_RATE)
        return (rates * tokens.mask[..., None]).transpose(2, 3)[..., None]

    def _first_state(self, tokens: MaskedTokens, carried: Carried) -> FastState:
        """Return the fast weights before the new looks: carried ones, or else learned ones."""
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
        """Run self-attention and a feed-forward network on a memory's tokens.

        Returns the tokens (n, m, EXPERT_WIDTH) after the layer, and their keys and values for the
        body's own attention in the same layer.

        Args:
            tokens: (n, m, EXPERT_WIDTH), with a mask (n, m).
        """
        projected = self.projected(self.norm1(tokens.values))
        queries, keys, values = (split_heads(part, HEADS) for part in projected.chunk(3, -1))
        may_attend = tokens.mask[:, None, None]
        mixed = functional.scaled_dot_product_attention(queries, keys, values, may_attend)
        attended = tokens.values + self.out(join_heads(mixed))
        after = attended + self.feed(self.norm2(attended))
        return after, ExpertJoin(keys, values, tokens.mask)


class ExpertJoin(Join):
    """Lets the body's first token, of robot and goal, attend to a memory's tokens as well.

    The tokens of things do not attend to them.
    """

    def __init__(self, keys: Tensor, values: Tensor, mask: Tensor) -> None:
        self._keys = keys
        self._values = values
        self._mask = mask

    def attended(self, keys: Tensor, values: Tensor, seen: Tensor) -> tuple[Tensor, Tensor, Tensor]:
        """Return keys, values and mask after appending the memory's tokens.

        Args:
            keys: (n, heads, L, size) of the body's tokens.
            values: of the same shape.
            seen: (n, 1, L, L) whether a token may attend to another; returned as (n, 1, L, L + m)
                with m tokens of the memory.
        """
        is_first = torch.arange(keys.shape[2], device=keys.device) == 0
        sees_memory = is_first[None, None, :, None] & self._mask[:, None, None]
        every_key = torch.cat([keys, self._keys], 2)
        every_value = torch.cat([values, self._values], 2)
        return every_key, every_value, torch.cat([seen, sees_memory], -1)


def _root_mean_square(values: Tensor) -> Tensor:
    """Return the root mean square of values (…, size), as (…, 1)."""
    return (values.square().mean(-1, keepdim=True) + EPSILON).sqrt()


def _clipped(change: Tensor) -> Tensor:
    """Return a change (…, rows, columns) whose norm is at most `MOST_CHANGE`."""
    norm = change.flatten(-2).norm(dim=-1)[..., None, None]
    clipped: Tensor = change * (MOST_CHANGE / norm.clamp(min=MOST_CHANGE))
    return clipped
