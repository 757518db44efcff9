"""The layers of the body, and what a memory does in each of them."""

from __future__ import annotations

from typing import Any

from torch import Tensor
from torch.nn import functional

WIDTH = 64
HEADS = 4
LAYERS = 2


class Join:
    """What a memory changes in one layer of the body; this one changes nothing.

    n sequences, one for each decision, of L tokens.
    """

    def attended(self, keys: Tensor, values: Tensor, seen: Tensor) -> tuple[Tensor, Tensor, Tensor]:
        """Return keys, values and mask for attention; a memory may append tokens of its own.

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
    """Return the tokens after one transformer layer, in which a memory may take part.

    The same as calling PyTorch's layer, step by step, because its own call has no place for `join`.

    Args:
        layer: ``nn.TransformerEncoderLayer``; norms come first.
        tokens: (n, L, WIDTH).
        seen: (n, L) whether a token may be attended to.
        join: what the memory changes in attention and feed-forward input.
    """
    attention = layer.self_attn
    projected = functional.linear(
        layer.norm1(tokens), attention.in_proj_weight, attention.in_proj_bias
    )
    queries, keys, values = (split_heads(part) for part in projected.chunk(3, -1))
    may_attend = seen[:, None, None].expand(-1, 1, tokens.shape[1], -1)
    keys, values, may_attend = join.attended(keys, values, may_attend)
    mixed = functional.scaled_dot_product_attention(queries, keys, values, may_attend)
    attended = tokens + attention.out_proj(join_heads(mixed))

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
