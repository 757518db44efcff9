"""Fast weights: a memory that is itself a small network, trained look by look while it is used.

This is called test-time training (option ``ttt``). Each look, a moment at which the front picture
is looked at, has tokens. From a token come a key, a value and a query: the fast weights take a step
of gradient descent towards predicting the value from the key, and are then read with the query. The
steps are called inner ones, as the training of the whole policy goes on around them.
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
    LayerHook,
    join_heads,
    split_heads,
)
from roboirg_learn.policy.memories import (
    Decisions,
    EmbeddedLooks,
    FrameTokens,
    LookMemory,
    MaskedTokens,
    MemoryCache,
    MemoryOutput,
    tokens_at_looks,
)

FAST_HEADS = 2
HEAD_WIDTH = WIDTH // FAST_HEADS
EXPERT_WIDTH = WIDTH // 2
"""Numbers of a token in the memory's own transformer, the expert."""
READ_LOOKS = 8
"""Most recent looks whose tokens the policy's network attends to, the present one included."""
INITIAL_RATE = 0.01
"""Learning rate of an inner step before anything is learned."""
MOST_RATE = 0.1
"""The greatest inner rate."""
MOST_CHANGE = 5.0
"""Norm to which a change of the fast weights is clipped."""
EPSILON = 1e-8


class FastNorm(NamedTuple):
    """The norm of what fast weights predict: values over their root mean square, scaled, shifted.

    Its parameters are learned with the policy, and not changed by inner steps.

    Attributes:
        scale: (heads, 1, size) the factor less 1.
        shift: (heads, 1, size) what is added.
    """

    scale: Tensor
    shift: Tensor

    def __call__(self, values: Tensor) -> Tensor:
        """Return values (n, heads, m, size) over their root mean square, scaled and shifted."""
        return values / _root_mean_square(values) * (1.0 + self.scale) + self.shift

    def pull_back(self, values: Tensor, error: Tensor) -> Tensor:
        """Return the gradient of the loss at the values: the backward pass of `__call__`, by hand.

        Inner steps also run under ``torch.no_grad``, so autograd cannot compute it. A change of
        `__call__` needs the same change here.

        Args:
            values: (n, heads, m, size) what `__call__` was given.
            error: the gradient of the loss at what it returned, of the same shape.
        """
        size = _root_mean_square(values)
        normalized = values / size
        scaled = error * (1.0 + self.scale)
        # Changing a value also changes the size that all are divided by.
        through_size = normalized * (scaled * normalized).mean(-1, keepdim=True)
        return (scaled - through_size) / size


class FastWeights(NamedTuple):
    """Fast weights of n episodes: a linear layer for each head, which `FastNorm` follows.

    Attributes:
        weights: (n, heads, size, size).
        biases: (n, heads, 1, size).
    """

    weights: Tensor
    biases: Tensor

    def updated(self, keys: Tensor, values: Tensor, rates: Tensor, norm: FastNorm) -> FastWeights:
        """Return the fast weights after one step of gradient descent on m tokens.

        The loss of a token is half the squared distance between the prediction from its key and
        ``value - key``: `read` adds its input back, so only the residual is learned. The steps of
        all tokens are summed and clipped.

        Args:
            keys: (n, heads, m, size) from which is predicted.
            values: (n, heads, m, size) what is to be read at these keys.
            rates: (n, heads, m, 1) learning rate of each token; 0 for padding.
            norm: applied to predictions.
        """
        predicted = keys @ self.weights + self.biases
        error = norm(predicted) - (values - keys)
        gradient = rates * norm.pull_back(predicted, error)
        weight_step = _clipped(keys.transpose(-1, -2) @ gradient)
        bias_step = _clipped(gradient.sum(-2, keepdim=True))
        return FastWeights(self.weights - weight_step, self.biases - bias_step)

    def read(self, queries: Tensor, norm: FastNorm) -> Tensor:
        """Return queries (n, heads, m, size) plus the weights' predictions from them."""
        return norm(queries @ self.weights + self.biases) + queries


class FastState(NamedTuple):
    """Fast weights after T looks, and what was read from them at each (B, T, m, WIDTH).

    `MemoryCache.state` of this memory.
    """

    fast: FastWeights
    read_values: Tensor


class InnerStep(NamedTuple):
    """What fast weights are updated and read with at one look: (B, heads, m, size), rates (…, 1).

    These are the arguments of `FastWeights.updated` and `FastWeights.read`.
    """

    queries: Tensor
    keys: Tensor
    values: Tensor
    rates: Tensor


class FastWeightMemory(LookMemory):
    """Fast weights, updated with the tokens of each look.

    What is read from them goes through a small transformer, the expert, layer by layer; in each
    layer the policy's network also attends to the expert's tokens.
    """

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
        # The expert.
        self.norm = nn.LayerNorm(WIDTH)
        self.out = nn.Linear(WIDTH, WIDTH, bias=False)
        self.narrow = nn.Linear(WIDTH, EXPERT_WIDTH)
        self.layers = nn.ModuleList(ExpertLayer() for _ in range(LAYERS))

    def forward(self, looks: EmbeddedLooks, decisions: Decisions) -> MemoryOutput:
        """Return what the memory changes in each layer at decisions.

        All looks (B, T) update the fast weights in turn; the policy's network attends to the tokens
        of the `READ_LOOKS` looks up to each decision, as they were read at their own time.
        """
        tokens = self.frames(looks)
        read_values = self._read_in_turn(tokens, looks.cache or MemoryCache())
        values = tokens.values + self.out(self.norm(read_values))
        recent = decisions.looks[:, None] - torch.arange(READ_LOOKS - 1, -1, -1)  # their numbers
        every_narrow = MaskedTokens(self.narrow(values), tokens.mask)
        narrow = tokens_at_looks(every_narrow, decisions.episodes, recent)
        hooks: list[LayerHook] = []
        for layer in self.layers:
            values, hook = layer(narrow)
            narrow = narrow._replace(values=values)
            hooks.append(hook)
        return MemoryOutput(hooks=hooks)

    def _read_in_turn(self, tokens: MaskedTokens, cache: MemoryCache) -> Tensor:
        """Update the fast weights look by look; return what is read at each (B, T, m, WIDTH).

        Each look first updates the weights with its m tokens and then reads them. Looks of an
        earlier call are not repeated: what they read is in `cache`, which is brought up to date.
        """
        new = MaskedTokens(tokens.values[:, cache.looks :], tokens.mask[:, cache.looks :])
        fast, read_values = self._first_state(new, cache)
        norm = FastNorm(self.scale, self.shift)
        new_reads = []
        for step in self._inner_steps(new):
            fast = fast.updated(step.keys, step.values, step.rates, norm)
            new_reads.append(fast.read(step.queries, norm))

        # New looks may show objects that earlier ones had no tokens for.
        added_tokens = tokens.values.shape[2] - read_values.shape[2]
        read_values = functional.pad(read_values, (0, 0, 0, added_tokens))
        if new_reads:
            by_head = torch.stack(new_reads, 1)  # (B, new looks, heads, m, size)
            joined = by_head.transpose(2, 3).flatten(3)
            read_values = torch.cat([read_values, joined], 1)
        cache.looks = read_values.shape[1]
        cache.state = FastState(fast, read_values)
        return read_values

    def _inner_steps(self, tokens: MaskedTokens) -> list[InnerStep]:
        """Return queries, keys, values and rates for each look of tokens (B, T, m, WIDTH)."""
        batch, length, count = tokens.mask.shape
        projected = self.projected(tokens.values)
        thirds = projected.reshape(batch, length, count, 3, FAST_HEADS, HEAD_WIDTH).unbind(3)
        parts_by_look = []  # of queries, keys and values, each for every look (B, heads, m, size)
        for norm, third in zip(self.norms, thirds, strict=True):
            parts_by_look.append(norm(third).transpose(2, 3).unbind(1))
        rates_by_look = self._rates(tokens).unbind(1)
        return [InnerStep(*parts) for parts in zip(*parts_by_look, rates_by_look, strict=True)]

    def _rates(self, tokens: MaskedTokens) -> Tensor:
        """Return the learning rate (B, T, heads, m, 1) of each token; 0 for padding."""
        # The inverse of softplus, so that untrained layers give about INITIAL_RATE.
        start = math.log(math.expm1(INITIAL_RATE))
        rates = functional.softplus(self.rate(tokens.values) + start).clamp(0.0, MOST_RATE)
        masked_rates = rates * tokens.mask[..., None]  # (B, T, m, heads)
        return masked_rates.transpose(2, 3)[..., None]

    def _first_state(self, tokens: MaskedTokens, cache: MemoryCache) -> FastState:
        """Return the state before the new looks: the cached one, else the learned first weights.

        In a first state nothing has been read yet.
        """
        if cache.state is not None:
            state: FastState = cache.state
            return state
        batch, _, count = tokens.mask.shape
        weights = self.weights.expand(batch, -1, -1, -1)
        biases = tokens.values.new_zeros(batch, FAST_HEADS, 1, HEAD_WIDTH)
        nothing_read = tokens.values.new_zeros(batch, 0, count, WIDTH)
        return FastState(FastWeights(weights, biases), nothing_read)


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

    def forward(self, tokens: MaskedTokens) -> tuple[Tensor, ExpertHook]:
        """Run self-attention and a feed-forward network on the memory's tokens.

        Returns the tokens (n, m, EXPERT_WIDTH) after the layer, and the hook by which the policy's
        network attends to them in its own layer of the same number.

        Args:
            tokens: (n, m, EXPERT_WIDTH), with a mask (n, m).
        """
        projected = self.projected(self.norm1(tokens.values))
        queries, keys, values = (split_heads(part, HEADS) for part in projected.chunk(3, -1))
        may_attend = tokens.mask[:, None, None]
        mixed = functional.scaled_dot_product_attention(queries, keys, values, may_attend)
        attended = tokens.values + self.out(join_heads(mixed))
        after = attended + self.feed(self.norm2(attended))
        return after, ExpertHook(keys, values, tokens.mask)


class ExpertHook(LayerHook):
    """Lets the first token, of robot and goal, attend to the memory's tokens as well.

    The tokens of tracks do not attend to them.

    Args:
        keys: (n, heads, m, size) of the memory's tokens.
        values: of the same shape.
        mask: (n, m) False for padding.
    """

    def __init__(self, keys: Tensor, values: Tensor, mask: Tensor) -> None:
        self._keys = keys
        self._values = values
        self._mask = mask

    def extend_attention(
        self, keys: Tensor, values: Tensor, may_attend: Tensor
    ) -> tuple[Tensor, Tensor, Tensor]:
        """Return keys, values and mask after appending the memory's m tokens; see `LayerHook`."""
        is_first = torch.arange(keys.shape[2], device=keys.device) == 0
        may_attend_to_memory = is_first[None, None, :, None] & self._mask[:, None, None]
        every_key = torch.cat([keys, self._keys], 2)
        every_value = torch.cat([values, self._values], 2)
        return every_key, every_value, torch.cat([may_attend, may_attend_to_memory], -1)


def _root_mean_square(values: Tensor) -> Tensor:
    """Return the root mean square of values (…, size), as (…, 1)."""
    return (values.square().mean(-1, keepdim=True) + EPSILON).sqrt()


def _clipped(change: Tensor) -> Tensor:
    """Return a change (…, rows, columns) whose norm is at most `MOST_CHANGE`."""
    norm = change.flatten(-2).norm(dim=-1)[..., None, None]
    clipped: Tensor = change * (MOST_CHANGE / norm.clamp(min=MOST_CHANGE))
    return clipped
