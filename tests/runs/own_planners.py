"""Planners of a user, each with another habit; they look around in their process."""

import gc
import os

import numpy as np

from roboirg.core.observations import PICTURE_SIZE


class StaysThenPicksUp:
    """Names two subgoals of a form, and then the second again."""

    cameras = ("front",)
    version = "mine-1"

    def reset(self, instruction, demonstration):
        self.said = instruction
        self.ends = []
        self.pictures = 0

    def learn(self, end):
        self.ends.append(end)

    def plan(self, observation, step):
        self.pictures += observation["front_rgb"].shape == (PICTURE_SIZE, PICTURE_SIZE, 3)
        return "pick up the container" if self.ends else "remain static for 5 steps"

    @property
    def metadata(self):
        kinds = {type(thing).__name__ for thing in gc.get_objects()}
        return {"world": np.bool_(kinds & {"World", "RoboIRGEnv", "Goal"})}

    def usage(self):
        named = sum(end.thing is not None for end in self.ends)
        return {
            "process": os.getpid(),
            "pictures": self.pictures,
            "ends": len(self.ends),
            "named": named,
        }


class AsksForTheWorld(StaysThenPicksUp):
    """Asks for the world."""

    def attach(self, env):
        self.env = env


class EndsItsProcess(StaysThenPicksUp):
    """Ends its process."""

    def plan(self, observation, step):
        os._exit(3)


class NoPlanner:
    def reset(self, instruction, demonstration):
        pass
