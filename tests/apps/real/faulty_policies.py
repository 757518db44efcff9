"""Policies that go wrong in one way each; importable in the processes in which they run."""

import time

import numpy as np

HORIZON = 20


class Still:
    """Stays where it is, one second at a time."""

    cameras = ()

    def __init__(self, seed=0):
        self.calls = 0

    def reset(self, instruction, demonstration):
        self.calls = 0

    def act(self, observation):
        self.calls += 1
        return np.tile(np.append(observation["joint_positions"], 1.0), (HORIZON, 1))


class Watching(Still):
    """Wants to see."""

    cameras = ("front", "wrist")

    def act(self, observation):
        assert observation["front_rgb"].shape == (256, 256, 3)
        assert observation["front_depth"].shape == (256, 256, 1)
        return super().act(observation)


class Late(Still):
    """Takes five seconds for its third chunk."""

    @property
    def latency_s(self):
        return 5.0 if self.calls == 3 else 0.0


class Thoughtful(Still):
    """Takes a quarter of a second for every chunk but the first."""

    @property
    def latency_s(self):
        return 0.25 if self.calls > 1 else 0.0


class Slow(Still):
    """Takes its time, of which it reports nothing: the machine is loaded."""

    def act(self, observation):
        time.sleep(0.3)
        return super().act(observation)


class Raises(Still):
    def act(self, observation):
        if self.calls == 2:
            raise ValueError("no idea")
        return super().act(observation)


class Leaves(Still):
    def act(self, observation):
        if self.calls == 2:
            import os

            os._exit(3)
        return super().act(observation)


class _Bad(Still):
    """Gives one bad row in its third chunk."""

    def act(self, observation):
        rows = super().act(observation)
        if self.calls == 3:
            self.spoil(rows)
        return rows


class Jumps(_Bad):
    def spoil(self, rows):
        rows[7:, 3] += 0.5


class NotFinite(_Bad):
    def spoil(self, rows):
        rows[7, 3] = np.nan


class Dives(_Bad):
    """Goes down slowly, to below the table."""

    def act(self, observation):
        rows = super().act(observation)
        if self.calls >= 3:
            rows[:, 1] += np.linspace(0.05, 1.0, HORIZON)
        return rows

    def spoil(self, rows):
        pass


class BeyondJoint(Still):
    def act(self, observation):
        rows = super().act(observation)
        rows[:, 6] += np.linspace(0.05, 1.0, HORIZON)
        return rows


class Watcher(Still):
    """Sees, and turns the first joint slowly."""

    cameras = ("front", "wrist")

    def act(self, observation):
        assert observation["front_rgb"].shape == (256, 256, 3)
        rows = super().act(observation)
        rows[:, 0] += 0.01 * np.arange(1, HORIZON + 1)
        return rows
