"""Policies that fail in every way and at every moment, honestly."""

import os
import time

import numpy as np


class Failing:
    """Holds still; `fail` is called in the phase `when`, at call number `at` of it."""

    cameras = ()
    when = "act"
    at = 1

    def __init__(self, seed=0):
        self.calls = 0
        self._maybe("init")

    def _maybe(self, phase):
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

    actions = "ee_pose"
    at = 3

    def act(self, observation):
        self._maybe("act")
        return np.append(observation["end_effector"] + 0.001, 1.0)


def _exit(self):
    raise SystemExit(3)


def _die(self):
    os._exit(7)


def _kill(self):
    os.kill(os.getpid(), 9)


def _sleep(self):
    time.sleep(3600)


def _failing(name, **fields):
    """Define a class of this module, so that a plan can name it."""
    globals()[name] = type(name, (Failing,), {**fields, "__module__": __name__})


BAD_ANSWERS = {
    "Nan": np.full(8, np.nan),
    "Narrow": np.zeros((2, 3)),
    "Text": "left",
    "Empty": np.zeros((0, 8)),
    "Beyond": np.full(8, 1e9),
    "Half": np.vstack([np.zeros((4, 8)), np.full((1, 8), np.inf)]),  # four good rows
}
_failing("Exits", fail=_exit)
for _when in ("init", "reset", "act", "hear", "usage", "close"):
    _failing(f"Raises_{_when}_1", when=_when)
_failing("Raises_act_2", at=2)
for _name, _answer in BAD_ANSWERS.items():
    for _at in (1, 2):
        _failing(f"{_name}_{_at}", fail=lambda self, answer=_answer: answer, at=_at)
for _name, _end in {"Die": _die, "Kill": _kill, "Sleep": _sleep}.items():
    for _when in ("reset", "act"):
        _failing(f"{_name}_{_when}", fail=_end, when=_when)
