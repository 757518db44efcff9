"""Rivals: a second value of the same kind as one that is meant, on equal terms."""

from __future__ import annotations

from roboirg.language.rivals.pair_draw import draw_pair
from roboirg.language.rivals.pair_words import (
    pair_command,
    pair_introduction,
    pair_notes,
    pair_reinforcement,
)
from roboirg.language.rivals.value_pair import pair_refusal

RIVAL_SETTINGS = ("direct-rival", "contextual-rival", "spatial-rival")
"""The settings that introduce a rival."""

__all__ = [
    "RIVAL_SETTINGS",
    "draw_pair",
    "pair_command",
    "pair_introduction",
    "pair_notes",
    "pair_refusal",
    "pair_reinforcement",
]
