"""A policy and a planner of a user's, as the golden runs play them in a process of their own."""

from __future__ import annotations

import numpy as np


class Reacher:
    """Moves its first joint by what it was told, and reports what it saw."""

    cameras = ("front", "wrist")
    depth = True
    observe_every = 8
    version = "net-1"

    def reset(self, instruction, demonstration):
        self.step = 0.02 if len(instruction) % 2 else -0.02
        self.metadata = {"frames": len(demonstration["front_rgb"])}
        self.seen = {"pictures": 0, "history": 0}

    def act(self, observation):
        self.seen["pictures"] += observation["front_rgb"].shape == (256, 256, 3)
        self.seen["history"] += len(observation["history"])
        self.seen["depth_cm"] = round(float(np.median(observation["front_depth"])) / 10)
        start = np.append(observation["joint_positions"][:7], 1.0)
        turns = np.arange(1, 17)[:, None] * np.eye(8)[0] * self.step
        return start + turns

    def usage(self):
        return self.seen


class Pointer:
    """Names three subgoals by words, one after the other ends."""

    cameras = ("front",)
    version = "net-1"

    def reset(self, instruction, demonstration):
        self.ends = []

    def learn(self, end):
        self.ends.append(end)

    def plan(self, observation, step):
        named = ("remain static for 5 steps", "pick up the red cube", "pick up the green cube")
        return named[min(len(self.ends), 2)]
