"""Listeners: they understand an instruction by a rule, and the scripted expert does what it says.

The rule is the declared meaning of the words (`roboirg.language.meaning`), or a surface rule, which
guesses by position and key words (`roboirg.shortcuts`).
"""

from __future__ import annotations

import zlib
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from roboirg.core.episode import Episode, Goal
from roboirg.core.observations import Demonstration
from roboirg.policies.builtin.scripted import READING, ScriptedPolicy
from roboirg.policies.contract.policy_calls import GUESSED
from roboirg.shortcuts.command_chance import goals_of_command, understood_goals
from roboirg.shortcuts.text_guess import draw_goal, guess_goal
from roboirg.tasks import goals_of
from roboirg.util.random_draws import draw

if TYPE_CHECKING:
    from roboirg.envs.environment import RoboIRGEnv


def choice_generator(seed: int, episode: Episode, instruction: str) -> np.random.Generator:
    """Return the generator of a listener's random choices in an episode.

    It depends on the policy's seed, the episode and the instruction, and not on what this process
    played before.
    """
    return np.random.default_rng([seed, episode.seed, zlib.crc32(instruction.encode())])


class ListenerPolicy(ScriptedPolicy):
    """Language oracle: understands the whole instruction, by its declared meaning where it has one.

    It knows the scene (for hidden cubes what the video shows) but not the goal. If several goals
    fit the words, it chooses one of them at random. If the words mean nothing, it guesses among all
    goals, and `usage` counts that. Of an instruction in turns it remembers every utterance.
    """

    metadata: ClassVar[Mapping[str, str]] = READING

    def __init__(self, seed: int = 0) -> None:
        super().__init__(seed)
        self._has_guessed = False

    def reset(self, instruction: str, demonstration: Demonstration) -> None:
        """Begin an episode, in which it has not guessed yet; decide on a goal once all is heard."""
        self._has_guessed = False
        super().reset(instruction, demonstration)

    def decide(self, env: RoboIRGEnv, instruction: str) -> Goal:
        """Return a goal of the scene that fits the whole instruction, at random if several do."""
        return self._chosen(understood_goals(env.instruction, env.episode), env, instruction)

    def _chosen(self, goals: Sequence[Goal], env: RoboIRGEnv, words: str) -> Goal:
        """Return one of the goals that fit the words, at random; if none fits, one of all goals.

        Args:
            goals: of the scene, that fit.
            env: with the episode.
            words: that were heard; the choice depends on them.
        """
        if not goals:
            self._has_guessed = True
            goals = goals_of(env.episode)
        rng = choice_generator(self.seed, env.episode, words)
        return draw(rng, goals)

    def usage(self) -> dict[str, float]:
        """Return ``{"guessed": 1.0}`` if it has guessed as the words mean nothing, else empty."""
        return {GUESSED: 1.0} if self._has_guessed else {}


class ForgetfulPolicy(ListenerPolicy):
    """Command-only baseline: hears the last utterance and guesses among the goals that fit it.

    Its success rate is the share of a setting that needs no context.
    """

    metadata: ClassVar[Mapping[str, str]] = {**READING, "reads_text": "only the last utterance"}

    def decide(self, env: RoboIRGEnv, instruction: str) -> Goal:  # noqa: ARG002
        """Return a goal of the scene that fits the last utterance, at random if several do."""
        command = env.instruction.command
        return self._chosen(goals_of_command(env.instruction, env.episode), env, command)


class ShortcutPolicy(ScriptedPolicy):
    """Guesses a goal by a surface rule, from the words and the goals that the task can have.

    The rule does not see the scene. If the scene does not have that goal, as it lacks a color, the
    policy holds still.
    """

    rule: ClassVar[str]
    """Name of a rule in `roboirg.shortcuts.SURFACE_RULES`."""
    metadata: ClassVar[Mapping[str, str]] = READING

    def decide(self, env: RoboIRGEnv, instruction: str) -> Goal | None:
        """Return the goal of the rule, at random where that leaves values open.

        None if the scene does not have it.
        """
        episode = env.episode
        guess = guess_goal(self.rule, instruction, episode.task)
        rng = choice_generator(self.seed, episode, instruction)
        return draw_goal(guess, goals_of(episode), rng)


class FirstMentionPolicy(ShortcutPolicy):
    """Takes the values that are named first: of *red, blue and green*, red."""

    rule = "first-mention"


class LastMentionPolicy(ShortcutPolicy):
    """Takes the values that are named last: of *red, blue and green*, green."""

    rule = "last-mention"


class EliminationPolicy(ShortcutPolicy):
    """Takes values that are not named, at random."""

    rule = "elimination"


class SurfacePolicy(ShortcutPolicy):
    """Goes by key words: *latter* is the second value, *other* an unnamed one, *twice* doubles."""

    rule = "surface"
