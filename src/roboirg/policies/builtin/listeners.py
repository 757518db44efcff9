"""Listeners: the interpreter, or a surface rule for the words, in front of the scripted expert."""

from __future__ import annotations

import zlib
from collections.abc import Mapping
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from roboirg.core.episode import Episode, Goal
from roboirg.policies.builtin.scripted import READING, ScriptedPolicy
from roboirg.shortcuts import draw_goal, guess_goal
from roboirg.shortcuts.command_chance import fitting_goals

if TYPE_CHECKING:
    from roboirg.envs.environment import RoboIRGEnv


def choice_generator(seed: int, episode: Episode, instruction: str) -> np.random.Generator:
    """Return the generator of a listener's random choices in an episode.

    Seeded by instruction and episode, so that a choice does not depend on what this process played
    before.
    """
    return np.random.default_rng([seed, episode.seed, zlib.crc32(instruction.encode())])


class ListenerPolicy(ScriptedPolicy):
    """Language oracle: understands the whole instruction with the interpreter.

    It knows the scene (for hidden cubes what the video shows) but not the goal. If several goals
    fit the words, it chooses one of them at random; if none does, one of all goals. Of an
    instruction in turns it remembers every utterance.
    """

    metadata: ClassVar[Mapping[str, str]] = READING

    def decide(self, env: RoboIRGEnv, instruction: str) -> Goal:
        """Return a goal that fits the instruction."""
        episode = env.episode
        choices = fitting_goals(instruction, episode)
        rng = choice_generator(self.seed, episode, instruction)
        return choices[int(rng.integers(len(choices)))]


class ForgetfulPolicy(ListenerPolicy):
    """Command-only baseline: hears the last utterance and guesses among the goals that fit it.

    Its success rate is the chance level of a setting: the share that needs no context.
    """

    metadata: ClassVar[Mapping[str, str]] = {**READING, "reads_text": "only the last utterance"}

    def decide(self, env: RoboIRGEnv, instruction: str) -> Goal:  # noqa: ARG002
        """Return a goal that fits the final command alone."""
        return super().decide(env, env.instruction.command)


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
