"""Rivals: a second value of the same kind as one that is meant, on equal terms."""

from __future__ import annotations

from roboirg.language.rivals.pair_words import (
    pair_command,
    pair_introduction,
    pair_notes,
    pair_reinforcement,
)
from roboirg.language.rivals.value_pair import (
    ValuePair,
    draw_pair,
    hidden_by_pair,
    pair_refusal,
    wants_pair,
)

__all__ = [
    "ValuePair",
    "draw_pair",
    "hidden_by_pair",
    "pair_command",
    "pair_introduction",
    "pair_notes",
    "pair_refusal",
    "pair_reinforcement",
    "wants_pair",
]
