"""What names the goal that somebody means; a policy then hears it as an explicit command."""

from __future__ import annotations

import zlib
from collections.abc import Mapping
from typing import Any, ClassVar

import numpy as np

from roboirg.core.episode import Goal
from roboirg.core.policy_ref import BUILT_IN
from roboirg.policies.builtin.listeners import choice_generator
from roboirg.policies.builtin.scripted import READING
from roboirg.policies.contract.base import AttachedPolicy
from roboirg.policies.contract.goal_naming import GoalNamer, SaidAndShown
from roboirg.policies.vlm.goal_schema import goal_schema
from roboirg.shortcuts.command_chance import understood_goals
from roboirg.shortcuts.goal_vocabulary import goal_vocabulary
from roboirg.shortcuts.surface_rules import SURFACE_RULES
from roboirg.shortcuts.text_guess import TextGuess, draw_goal, guess_goal
from roboirg.util.random_draws import draw

MEANING = "listener"
"""The namer that knows the declared meaning, named like the policy that does."""
OF_OURS = (MEANING, *SURFACE_RULES)
"""The namers that need no model and no file."""


class RuleNamer:
    """Names the goal by a surface rule, from the words alone: it sees neither scene nor picture.

    Args:
        rule: one of `roboirg.shortcuts.SURFACE_RULES`.
        seed: of the choice among values that the rule leaves open.
    """

    version: ClassVar[str] = BUILT_IN

    def __init__(self, rule: str, seed: int = 0) -> None:
        self._rule = rule
        self._seed = seed
        self.metadata: Mapping[str, Any] = {**READING, "rule": rule}

    def name_goal(self, given: SaidAndShown) -> Goal | None:
        """Return the goal of the rule; None if the words say nothing of a part of the goal."""
        guess = guess_goal(self._rule, given.text, given.task)
        if _leaves_all_open(guess, given.task):
            return None
        rng = np.random.default_rng([self._seed, zlib.crc32(given.text.encode())])
        return draw_goal(guess, goal_schema(given.task).goals.values(), rng)


def _leaves_all_open(guess: TextGuess, task: str) -> bool:
    """Return whether a part of a goal could be anything: the text does not speak of it.

    So it is where a command points at a place, *take the cube that's there*, without a color.
    """
    vocabulary = goal_vocabulary(task)
    for slot, places in guess.items():
        values = set(vocabulary[slot].values)
        if len(values) > 1 and any(set(candidates) == values for candidates in places):
            return True
    return False


class MeaningNamer(AttachedPolicy):
    """Names the goal that the words declare. Privileged: it reads what the benchmark knows.

    Args:
        seed: of the choice among several goals that fit the words.
    """

    version: ClassVar[str] = BUILT_IN
    metadata: ClassVar[Mapping[str, Any]] = READING

    def __init__(self, seed: int = 0) -> None:
        self._seed = seed

    def name_goal(self, given: SaidAndShown) -> Goal | None:
        """Return a goal that fits the words; None if they declare no meaning."""
        episode = self.env.episode
        goals = understood_goals(self.env.instruction, episode)
        if not goals:
            return None
        return draw(choice_generator(self._seed, episode, given.text), goals)


def make_namer(name: str, seed: int) -> GoalNamer:
    """Make one of the namers `OF_OURS`."""
    if name == MEANING:
        return MeaningNamer(seed)
    return RuleNamer(name, seed)
