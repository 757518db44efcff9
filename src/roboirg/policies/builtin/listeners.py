"""Listeners: a reader of words in front of the oracle's hands."""

from __future__ import annotations

import zlib
from typing import TYPE_CHECKING

import numpy as np

from roboirg.core.episode import Goal
from roboirg.language import interpret
from roboirg.policies.builtin.scripted import ScriptedPolicy
from roboirg.tasks import get_task

if TYPE_CHECKING:
    from roboirg.envs.environment import RoboIRGEnv


class ListenerPolicy(ScriptedPolicy):
    """Hears all that is said and understands it with the resolver.

    It knows the scene (for hidden cubes what the video shows) but not the goal. If several goals
    fit the words it chooses one of them at random, if none does one of all.
    """

    def decide(self, env: RoboIRGEnv, instruction: str) -> Goal:
        """A goal that fits what was heard."""
        episode = env.episode
        goals = interpret(instruction, episode.scene, episode.task).goals
        choices = goals or get_task(episode.task).goals(episode.scene)
        # Seeded by what is heard and where, so that the choice does not depend on what the
        # process played before.
        rng = np.random.default_rng([self.seed, episode.seed, zlib.crc32(instruction.encode())])
        return choices[int(rng.integers(len(choices)))]


class ForgetfulPolicy(ListenerPolicy):
    """Hears only the final command, then guesses uniformly among the goals that fit it.

    What it reaches is the chance level of a setting: the share that needs no context.
    """

    def decide(self, env: RoboIRGEnv, instruction: str) -> Goal:  # noqa: ARG002
        """A goal that fits the final command alone."""
        return super().decide(env, env.instruction.command)
