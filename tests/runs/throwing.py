"""A policy, a planner and a command that raise where the environment variable HOOK says."""

import os

import numpy as np

HOOK = os.environ.get("HOOK", "")


def throw(hook, value=None, given=()):
    if hook == HOOK:
        raise (SystemExit if hook == "class body" else ValueError)(f"from {hook}")
    if f"a key in {hook}" == HOOK:
        (*_, seen) = given
        seen["front"]
    return value


def method(hook, value=None):
    return lambda *given: throw(hook, value, given)


throw("import")


class It:
    throw("class body")
    cameras = ("front",)
    demonstration_frames = "none"
    depth = property(method("needs", value=False))
    version = property(method("version", value="1"))
    metadata = property(method("metadata", value={}))
    subgoal = property(method("subgoal"))
    usage = method("usage", value={})
    act = method("act", value=np.ones((24, 8)))
    __init__, reset, follow, hear, close = map(
        method, ("__init__", "reset", "follow", "hear", "close")
    )


class Planner:
    version = "1"
    __init__, reset = map(method, ("planner's __init__", "planner's reset"))
    plan = method("planner's plan", value="pick up the cube")


def command():
    throw("command")
