"""A policy, a planner and a command that raise where the environment variable HOOK says."""

import os

import numpy as np


def throw(hook, value=None):
    if os.environ.get("HOOK") == hook:
        raise ValueError(f"from {hook}")
    return value


def method(hook, value=None):
    return lambda *_: throw(hook, value)


throw("import")


class It:
    throw("class body")
    cameras = ("front",)
    demonstration_frames = "none"
    depth = property(method("needs", value=False))
    version = property(method("version", value="1"))
    metadata = property(method("metadata", value={}))
    subgoal = property(method("subgoal"))
    __init__, follow, hear, close = map(method, ("__init__", "follow", "hear", "close"))
    usage = method("usage", value={})

    def reset(self, instruction, demonstration):
        throw("reset")
        if os.environ.get("HOOK") == "a key of the video":
            demonstration["front"]

    def act(self, observation):
        throw("act")
        if os.environ.get("HOOK") == "a key of the observation":
            observation["front"]
        return np.ones((24, 8))


class Planner:
    version = "1"
    __init__, reset = map(method, ("planner's __init__", "planner's reset"))
    plan = method("planner's plan", value="pick up the cube")


def command():
    throw("command")
