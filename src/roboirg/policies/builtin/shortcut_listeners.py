"""Shortcut listeners: a surface rule for the words, and the hands of the oracle."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, ClassVar

from roboirg.core.episode import Goal
from roboirg.policies.builtin.listeners import choice_generator
from roboirg.policies.builtin.scripted import READING, ScriptedPolicy
from roboirg.shortcuts import draw_goal, guess_goal

if TYPE_CHECKING:
    from roboirg.envs.environment import RoboIRGEnv


class ShortcutPolicy(ScriptedPolicy):
    """Chooses a goal by a surface rule, from the instruction and the task's vocabulary alone.

    If the scene does not have that goal, for want of a color, it holds still.
    """

    rule: ClassVar[str]
    """Name of a rule in `roboirg.shortcuts.SURFACE_RULES`."""
    metadata: ClassVar[Mapping[str, str]] = READING

    def decide(self, env: RoboIRGEnv, instruction: str) -> Goal | None:
        """Return the goal of the rule; what the rule leaves open is drawn at random."""
        episode = env.episode
        guess = guess_goal(self.rule, instruction, episode.task)
        return draw_goal(guess, episode, choice_generator(self.seed, episode, instruction))


class FirstMentionPolicy(ShortcutPolicy):
    """Takes the values that are named first."""

    rule = "first-mention"


class LastMentionPolicy(ShortcutPolicy):
    """Takes the values that are named last."""

    rule = "last-mention"


class EliminationPolicy(ShortcutPolicy):
    """Takes values that are not named."""

    rule = "elimination"


class SurfacePolicy(ShortcutPolicy):
    """Chooses among the first value, the unnamed one and arithmetic by key words of the command."""

    rule = "surface"
