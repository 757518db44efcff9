"""The layers of the body, and what a memory does in each of them."""

from __future__ import annotations

from typing import Any

from torch import Tensor
from torch.nn import functional

WIDTH = 64
HEADS = 4
LAYERS = 2


class Join:
    """What a memory does in one layer; this one does nothing. n sequences, L tokens."""

    def attended(self, keys: Tensor, values: Tensor, seen: Tensor) -> tuple[Tensor, Tensor, Tensor]:
        """Return what the tokens attend to.

        Args:
            keys: (n, HEADS, L, size) of the tokens.
            values: of the same shape.
            seen: (n, 1, L, L) whether a token may attend to another.
        """
        return keys, values, seen

    def modulated(self, normed: Tensor) -> Tensor:
        """Return the input (n, L, WIDTH) of the feed-forward network."""
        return normed


def run_layer(layer: Any, tokens: Tensor, seen: Tensor, join: Join) -> Tensor:  # noqa: ANN401
    """Return the tokens after one layer: attention, then a feed-forward network.

    Args:
        layer: one of a body's encoder, whose layers are run one by one.
        tokens: (n, L, WIDTH).
        seen: (n, L) whether there is a token.
        join: of a memory.
    """
    attention = layer.self_attn
    projected = functional.linear(
        layer.norm1(tokens), attention.in_proj_weight, attention.in_proj_bias
    )
    queries, keys, values = (split_heads(part) for part in projected.chunk(3, -1))
    open_to = seen[:, None, None].expand(-1, 1, tokens.shape[1], -1)
    keys, values, open_to = join.attended(keys, values, open_to)
    found = functional.scaled_dot_product_attention(queries, keys, values, open_to)
    attended = tokens + attention.out_proj(join_heads(found))

    hidden = layer.linear1(join.modulated(layer.norm2(attended)))
    after: Tensor = attended + layer.linear2(functional.relu(hidden))
    return after


def split_heads(values: Tensor, heads: int = HEADS) -> Tensor:
    """Return values (n, L, heads * size) as (n, heads, L, size)."""
    split: Tensor = values.reshape(*values.shape[:2], heads, -1).transpose(1, 2)
    return split


def join_heads(values: Tensor) -> Tensor:
    """Return values (n, heads, L, size) as (n, L, heads * size)."""
    return values.transpose(1, 2).flatten(2)
