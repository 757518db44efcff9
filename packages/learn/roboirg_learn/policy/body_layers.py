"""The transformer layers of the policy's network, and what a memory changes in each of them."""

from __future__ import annotations

from typing import Any

from torch import Tensor
from torch.nn import functional

WIDTH = 64
"""Numbers of a token."""
HEADS = 4
"""Attention heads of a layer."""
LAYERS = 2


class LayerHook:
    """What a memory changes in one transformer layer; this one changes nothing.

    The layer has n sequences, one for each decision, of L tokens.
    """

    def extend_attention(
        self, keys: Tensor, values: Tensor, may_attend: Tensor
    ) -> tuple[Tensor, Tensor, Tensor]:
        """Return keys, values and mask for attention; a memory may append tokens of its own.

        With m tokens of the memory they become (n, HEADS, L + m, size) and (n, 1, L, L + m).

        Args:
            keys: (n, HEADS, L, size) of the tokens.
            values: of the same shape.
            may_attend: (n, 1, L, L) whether a token (third axis) may attend to another (last).
        """
        return keys, values, may_attend

    def modulate(self, normed: Tensor) -> Tensor:
        """Return the input (n, L, WIDTH) of the feed-forward network, given it after the norm."""
        return normed


def run_layer(
    layer: Any,  # noqa: ANN401 - its parts are modules, which PyTorch does not type
    tokens: Tensor,
    is_attended_to: Tensor,
    hook: LayerHook,
) -> Tensor:
    """Return the tokens after one transformer layer, which a memory may change.

    The same as calling PyTorch's layer, step by step, because its own call has no place for `hook`.

    Args:
        layer: ``nn.TransformerEncoderLayer`` with ``norm_first``.
        tokens: (n, L, WIDTH).
        is_attended_to: (n, L) whether any token may attend to this one.
        hook: what the memory changes in attention and feed-forward input.
    """
    attention = layer.self_attn
    projected = functional.linear(
        layer.norm1(tokens), attention.in_proj_weight, attention.in_proj_bias
    )
    queries, keys, values = (split_heads(part) for part in projected.chunk(3, -1))
    may_attend = is_attended_to[:, None, None].expand(-1, 1, tokens.shape[1], -1)
    keys, values, may_attend = hook.extend_attention(keys, values, may_attend)
    mixed = functional.scaled_dot_product_attention(queries, keys, values, may_attend)
    attended = tokens + attention.out_proj(join_heads(mixed))

    hidden = layer.linear1(hook.modulate(layer.norm2(attended)))
    after: Tensor = attended + layer.linear2(functional.relu(hidden))
    return after


def split_heads(values: Tensor, heads: int = HEADS) -> Tensor:
    """Return values (n, L, heads * size) as (n, heads, L, size)."""
    split: Tensor = values.reshape(*values.shape[:2], heads, -1).transpose(1, 2)
    return split


def join_heads(values: Tensor) -> Tensor:
    """Return values (n, heads, L, size) as (n, L, heads * size)."""
    return values.transpose(1, 2).flatten(2)
