"""Listeners: the interpreter in front of the scripted expert."""

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
    """Language oracle: understands the whole instruction with the interpreter.

    It knows the scene (for hidden cubes what the video shows) but not the goal. If several goals
    fit the words, it chooses one of them at random; if none does, one of all goals. Of an
    instruction in turns it remembers every utterance.
    """

    def decide(self, env: RoboIRGEnv, instruction: str) -> Goal:
        """Return a goal that fits the instruction."""
        episode = env.episode
        goals = interpret(instruction, episode.scene, episode.task).goals
        choices = goals or get_task(episode.task).goals(episode.scene)
        # Seeded by instruction and episode, so that the choice does not depend on what this
        # process played before.
        rng = np.random.default_rng([self.seed, episode.seed, zlib.crc32(instruction.encode())])
        return choices[int(rng.integers(len(choices)))]


class ForgetfulPolicy(ListenerPolicy):
    """Command-only baseline: hears the last utterance and guesses among the goals that fit it.

    Its success rate is the chance level of a setting: the share that needs no context.
    """

    def decide(self, env: RoboIRGEnv, instruction: str) -> Goal:  # noqa: ARG002
        """Return a goal that fits the final command alone."""
        return super().decide(env, env.instruction.command)
