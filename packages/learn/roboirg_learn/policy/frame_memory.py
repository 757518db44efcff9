"""Memories that attend to some of the looks so far, and modulate the layers of the network.

A look is a moment at which the front picture is looked at. `EvenFrameMemory` takes looks evenly
spaced over all that was seen, `KeptFrameMemory` those that a planner keeps.
"""

from __future__ import annotations

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
    MemoryOutput,
    tokens_at_looks,
)

FRAME_COUNT = 32
INITIAL_WEIGHT_STD = 0.002
"""Standard deviation of the weights of scale and shift before anything is learned."""


def even_frames(now: Tensor) -> Tensor:
    """Return `FRAME_COUNT` numbers of looks, evenly spaced from the first to the present one.

    With fewer looks it is all of them, and -1 in the other places: 2 → 0, 1, 2, -1, -1, …

    Args:
        now: (…) number of the present look; the result is (…, FRAME_COUNT).
    """
    last = now[..., None]
    evenly_spaced = (last * torch.linspace(0, 1, FRAME_COUNT)).round().long()
    first_numbers = torch.arange(FRAME_COUNT)
    all_looks = torch.where(first_numbers <= last, first_numbers, -1)
    return torch.where(last < FRAME_COUNT, all_looks, evenly_spaced)


class EvenFrameMemory(LookMemory):
    """The tokens of `FRAME_COUNT` looks give scale and shift in each layer (FiLM).

    No token is added to those of the network.
    """

    def __init__(self) -> None:
        super().__init__()
        self.frames = FrameTokens()
        self.layers = nn.ModuleList(Modulation() for _ in range(LAYERS))

    def forward(self, looks: EmbeddedLooks, decisions: Decisions) -> MemoryOutput:
        """Return how the chosen looks modulate each layer at decisions."""
        tokens = self.frames(looks)
        chosen = self.chosen(looks, decisions)
        hooks = [layer(tokens, decisions.episodes, chosen) for layer in self.layers]
        return MemoryOutput(hooks=hooks)

    def chosen(self, looks: EmbeddedLooks, decisions: Decisions) -> Tensor:  # noqa: ARG002
        """Return the numbers of looks (N, frames) that are attended to; -1 for none."""
        return even_frames(decisions.looks)


class KeptFrameMemory(EvenFrameMemory):
    """The same with looks that a planner keeps."""

    def chosen(self, looks: EmbeddedLooks, decisions: Decisions) -> Tensor:  # noqa: ARG002
        """Return the numbers of the looks that are kept (N, S); -1 for none."""
        if looks.kept_looks is None:
            raise RuntimeError("KeptFrameMemory needs a planner's looks.")
        return looks.kept_looks


class Modulation(nn.Module):
    """Cross-attention from the network's tokens to those of looks, which gives scale and shift."""

    def __init__(self) -> None:
        super().__init__()
        # Queries are of the network's tokens, keys and values (one head) of those of looks.
        self.norm = nn.RMSNorm(WIDTH)
        self.query = nn.Linear(WIDTH, WIDTH, bias=False)
        self.keyed = nn.Linear(WIDTH, 2 * (WIDTH // HEADS), bias=False)
        self.out = nn.Linear(WIDTH, WIDTH, bias=False)
        self.scale_shift = nn.Linear(WIDTH, 2 * WIDTH)
        # Almost no change at first, so that the network begins as without memory.
        nn.init.normal_(self.scale_shift.weight, std=INITIAL_WEIGHT_STD)
        nn.init.zeros_(self.scale_shift.bias)

    def forward(self, tokens: MaskedTokens, episodes: Tensor, chosen: Tensor) -> ModulationHook:
        """Return what scales and shifts one layer's input: keys and values of the chosen looks.

        Args:
            tokens: (B, T, m, WIDTH) of all looks.
            episodes: (N,) number of the episode of each decision.
            chosen: (N, frames) looks to attend to; -1 for none.
        """
        keys_and_values = MaskedTokens(self.keyed(self.norm(tokens.values)), tokens.mask)
        of_chosen = tokens_at_looks(keys_and_values, episodes, chosen)
        keys, values = of_chosen.values[:, None].chunk(2, -1)
        return ModulationHook(self, keys, values, of_chosen.mask[:, None, None])


class ModulationHook(LayerHook):
    """Scales and shifts what goes into the feed-forward network; the residual stays as it is.

    Args:
        modulation: the layers that do so.
        keys: (n, 1, tokens, size) of the remembered looks.
        values: of the same shape.
        mask: (n, 1, 1, tokens) False for padding.
    """

    def __init__(self, modulation: Modulation, keys: Tensor, values: Tensor, mask: Tensor) -> None:
        self._modulation = modulation
        self._keys = keys
        self._values = values
        self._mask = mask

    def modulate(self, normed: Tensor) -> Tensor:
        """Return the feed-forward input (n, L, WIDTH), scaled and shifted by what is remembered.

        Each of the network's L tokens attends to the tokens of the remembered looks.

        Args:
            normed: (n, L, WIDTH) the input after its norm.
        """
        queries = split_heads(self._modulation.query(normed))
        # Queries have four heads, keys and values one, which all of them share.
        read = functional.scaled_dot_product_attention(
            queries.flatten(1, 2)[:, None], self._keys, self._values, self._mask
        )
        joined = self._modulation.out(join_heads(read.reshape(queries.shape)))
        scale, shift = self._modulation.scale_shift(joined).chunk(2, -1)
        after: Tensor = normed * (1.0 + scale) + shift
        return after
