"""Policies that fail in every way and at every moment, honestly."""

from __future__ import annotations

import os
import time

import numpy as np


class Failing:
    """Holds still; `fail` is called in the phase `when`, at call number `at` of it."""

    cameras = ()
    when, at = "act", 1

    def __init__(self, seed: int = 0) -> None:
        self.calls = 0
        self._maybe("init")

    def _maybe(self, phase: str):
        if phase == self.when:
            self.calls += 1
            if self.calls == self.at:
                return self.fail()
        return None

    def fail(self):
        raise RuntimeError("it fails")

    def reset(self, instruction, demonstration):
        self._maybe("reset")

    def hear(self, text, step):
        self._maybe("hear")

    def act(self, observation):
        bad = self._maybe("act")
        return np.append(observation["joint_positions"][:7], 1.0) if bad is None else bad

    def usage(self):
        self._maybe("usage")
        return {}

    def close(self):
        self._maybe("close")


class Posing(Failing):
    """Moves the tool, and raises after some answers."""

    actions, at = "ee_pose", 3

    def act(self, observation):
        self._maybe("act")
        return np.append(observation["end_effector"] + 0.001, 1.0)


def _exit(self):
    raise SystemExit(3)


def _nan(self):
    return np.full(8, np.nan)


def _narrow(self):
    return np.zeros((2, 3))


def _text(self):
    return "left"


def _empty(self):
    return np.zeros((0, 8))


def _beyond(self):
    return np.full(8, 1e9)


def _half(self):
    """Four good rows and one that cannot be executed."""
    return np.vstack([np.zeros((4, 8)), np.full((1, 8), np.inf)])


def _die(self):
    os._exit(7)


def _kill(self):
    os.kill(os.getpid(), 9)


def _sleep(self):
    time.sleep(3600)


def _failing(name, **fields):
    globals()[name] = type(name, (Failing,), {**fields, "__module__": __name__})
    return name


IN_PROCESS = [
    _failing(f"Raises_{when}_{at}", when=when, at=at)
    for when, at in (("init", 1), ("reset", 1), ("act", 1), ("act", 2), ("hear", 1), ("usage", 1),
                     ("close", 1))
] + [
    _failing(f"{fail.__name__.strip('_').title()}_{at}", fail=fail, at=at)
    for fail in (_exit, _nan, _narrow, _text, _empty, _beyond, _half) for at in (1, 2)
] + ["Posing"]  # fmt: skip
HOSTED = [
    _failing(f"{fail.__name__.strip('_').title()}_{when}", fail=fail, when=when)
    for fail in (_die, _kill, _sleep) for when in ("reset", "act")
]  # fmt: skip
