"""Grounded references: words whose referent only the scene or the video shows."""

from __future__ import annotations

from roboirg.language.grounded.clue import Clue, draw_clue
from roboirg.language.grounded.counted import LEFT, amount_clues, repeat_clues
from roboirg.language.grounded.placements import placement_clues
from roboirg.language.grounded.things import late, spoken_clues, thing_clues

__all__ = [
    "LEFT",
    "Clue",
    "amount_clues",
    "draw_clue",
    "late",
    "placement_clues",
    "repeat_clues",
    "spoken_clues",
    "thing_clues",
]
