"""Shortcuts: how far rules and models come that see the words only, and understand none of them."""

from __future__ import annotations

from roboirg.shortcuts.surface_rules import SURFACE_RULES
from roboirg.shortcuts.text_guess import draw_goal, goal_share, guess_goal

__all__ = ["SURFACE_RULES", "draw_goal", "goal_share", "guess_goal"]
