"""Shortcuts: how far rules and models come that see the words only, and understand none of them.

A rule guesses a goal from the words alone, by their position or key words (`surface_rules`,
`text_guess`); models learn from the words or from the scene alone (`goal_learner`).
"""

from __future__ import annotations

from roboirg.shortcuts.surface_rules import SURFACE_RULES
from roboirg.shortcuts.text_guess import draw_goal, goal_share, guess_goal

__all__ = ["SURFACE_RULES", "draw_goal", "goal_share", "guess_goal"]
