"""A memory of looks evenly spaced over all that was seen, which modulates the body's layers."""

from __future__ import annotations

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
    FrameTokens,
    LookMemory,
    Looks,
    MaskedTokens,
    Remembered,
    choose_only_seen,
    tokens_at_looks,
    values_at_looks,
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
    evenly = (last * torch.linspace(0, 1, FRAME_COUNT)).round().long()
    first = torch.arange(FRAME_COUNT)
    all_looks = torch.where(first <= last, first, -1)
    return torch.where(last < FRAME_COUNT, all_looks, evenly)


class EvenFrameMemory(LookMemory):
    """The tokens of `FRAME_COUNT` looks give scale and shift in each layer; no token is added."""

    def __init__(self) -> None:
        super().__init__()
        self.frames = FrameTokens()
        self.layers = nn.ModuleList(Modulation() for _ in range(LAYERS))

    def forward(self, looks: Looks, decisions: Tensor) -> Remembered:
        """Return how the chosen looks modulate each layer of the body at decisions (B, D)."""
        tokens = self.frames(looks)
        chosen = self.chosen(looks, decisions)
        joins = [layer(tokens, chosen) for layer in self.layers]
        return choose_only_seen(looks, decisions, joins)

    def chosen(self, looks: Looks, decisions: Tensor) -> Tensor:  # noqa: ARG002
        """Return the numbers of looks (B, D, frames) that are attended to; -1 for none."""
        return even_frames(decisions)


class KeptFrameMemory(EvenFrameMemory):
    """The same with looks that a planner keeps; it may point at what is out of sight."""

    def forward(self, looks: Looks, decisions: Tensor) -> Remembered:
        remembered = super().forward(looks, decisions)
        return remembered._replace(can_choose=values_at_looks(looks.known, decisions))

    def chosen(self, looks: Looks, decisions: Tensor) -> Tensor:  # noqa: ARG002
        """Return the numbers of the looks that are kept (B, D, S); -1 for none."""
        if looks.kept_looks is None:
            raise RuntimeError("KeptFrameMemory needs a planner's looks.")
        return looks.kept_looks


class Modulation(nn.Module):
    """Cross-attention from the body's tokens to those of frames, which gives scale and shift."""

    def __init__(self) -> None:
        super().__init__()
        # Queries are of the body's tokens, keys and values (one head) of those of looks.
        self.norm = nn.RMSNorm(WIDTH)
        self.query = nn.Linear(WIDTH, WIDTH, bias=False)
        self.keyed = nn.Linear(WIDTH, 2 * (WIDTH // HEADS), bias=False)
        self.out = nn.Linear(WIDTH, WIDTH, bias=False)
        self.scale_shift = nn.Linear(WIDTH, 2 * WIDTH)
        # Almost no change at first, so that the body learns as without memory.
        nn.init.normal_(self.scale_shift.weight, std=INITIAL_WEIGHT_STD)
        nn.init.zeros_(self.scale_shift.bias)

    def forward(self, tokens: MaskedTokens, chosen: Tensor) -> ModulationJoin:
        """Return what scales and shifts one layer's input: keys and values of the chosen looks.

        Args:
            tokens: (B, T, m, WIDTH) of all looks.
            chosen: (B, D, frames) looks to attend to; -1 for none.
        """
        keyed = MaskedTokens(self.keyed(self.norm(tokens.values)), tokens.mask)
        frames = tokens_at_looks(keyed, chosen)
        keys, values = frames.values[:, None].chunk(2, -1)
        return ModulationJoin(self, keys, values, frames.mask[:, None, None])


class ModulationJoin(Join):
    """Scales and shifts what goes into the feed-forward network; the residual stays as it is."""

    def __init__(self, modulation: Modulation, keys: Tensor, values: Tensor, mask: Tensor) -> None:
        self._modulation = modulation
        self._keys = keys
        self._values = values
        self._mask = mask

    def modulated(self, normed: Tensor) -> Tensor:
        """Return the feed-forward input (n, L, WIDTH), scaled and shifted by what is remembered.

        Each of the body's L tokens attends to the tokens of the remembered looks.
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
