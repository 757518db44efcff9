"""Rivals: a second value of the same kind as one that is meant, on equal terms."""

from __future__ import annotations

from roboirg.language.rivals.pair_draw import draw_pair
from roboirg.language.rivals.pair_words import pair_command, pair_introduction, pair_notes
from roboirg.language.rivals.value_pair import pair_refusal

__all__ = [
    "draw_pair",
    "pair_command",
    "pair_introduction",
    "pair_notes",
    "pair_refusal",
]
