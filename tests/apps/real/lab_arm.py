"""A stand-in with the interface of LeRobot's `Robot`: an arm that is where it was told to be."""

import threading
import time

import numpy as np

HOME = [0.0, 0.0, 0.0, -np.pi / 2, 0.0, np.pi / 2, np.pi / 4]
JOINTS = [f"joint_{number}.pos" for number in range(1, 8)]


class LabArm:
    name = "lab_arm"

    def __init__(self):
        self.is_connected = False
        self.joints = dict(zip(JOINTS, HOME, strict=True)) | {"gripper.pos": 1.0}
        self.sent = []
        self.blind_after = float("inf")
        self.breaks_after = float("inf")
        self.began = 0.0
        self._rng = np.random.default_rng(0)
        self._last = None

    @property
    def observation_features(self):
        return {**dict.fromkeys(self.joints, float), "front": (480, 640, 3), "wrist": (480, 640, 3)}

    @property
    def action_features(self):
        return dict.fromkeys(self.joints, float)

    def connect(self, calibrate=True):
        assert not self.is_connected
        self.is_connected, self.began = True, time.monotonic()

    def get_observation(self):
        assert self.is_connected
        assert threading.current_thread().name == "observations"
        time.sleep(1 / 60)  # waits for its cameras
        if len(self.sent) > self.breaks_after:
            raise OSError("cable")
        if self._last is None or len(self.sent) <= self.blind_after:
            self._last = {
                name: self._rng.integers(0, 255, (480, 640, 3), dtype=np.uint8)
                for name in ("front", "wrist")
            }
        return {**self.joints, **self._last}

    def send_action(self, action):
        assert set(action) == set(self.action_features)
        self.sent.append((time.monotonic(), dict(action)))
        self.joints = dict(action)
        return action

    def disconnect(self):
        self.is_connected = False


MADE = []


def make():
    MADE.append(LabArm())
    return MADE[-1]


class NoArm:
    def connect(self):
        pass


def make_none():
    return NoArm()
