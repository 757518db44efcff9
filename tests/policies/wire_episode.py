"""A small made-up episode: what a policy is shown, with pictures of 8 x 8."""

from contextlib import contextmanager

import numpy as np

from roboirg.policies import make_policy

INSTRUCTION = "Put the Red cube on the target."


def picture(number, size=8, channel=0):
    values = np.arange(size * size * 3, dtype=np.int64) * (7 + channel) + 31 * number
    return (values % 251).astype(np.uint8).reshape(size, size, 3)


def moment(number, size=8, history=None, *, sensors=False):
    observation = {
        "front_rgb": picture(number, size),
        "wrist_rgb": picture(number, size, channel=1),
        "joint_positions": np.linspace(-1, 1, 7).astype(np.float32) + np.float32(number / 8),
        "gripper": np.array([0.04, 0.02], np.float32) / np.float32(1 + number),
        "end_effector": np.arange(6, dtype=np.float64) + number / 4,
        "instruction": INSTRUCTION,
    }
    if sensors:
        observation |= calibrated(number, size)
    if history is not None:
        observation["history"] = tuple(history)
    return observation


def calibrated(number, size=8):
    """Depth and matrices."""
    fields = {}
    for place, camera in enumerate(("front", "wrist")):
        depth = np.arange(size * size, dtype=np.int16).reshape(size, size, 1) + 400 * place
        fields[f"{camera}_depth"] = depth + np.int16(number)
        fields[f"{camera}_extrinsic"] = np.eye(3, 4, dtype=np.float32) * (number + place + 1)
        fields[f"{camera}_intrinsic"] = np.eye(3, dtype=np.float32) * 128
    return fields


def video(length, size=8, *, sensors=False):
    """A demonstration of a given length."""
    moments = [moment(number, size, sensors=sensors) for number in range(max(length, 1))]
    fields = [field for field in moments[0] if field != "instruction"]
    return {field: np.stack([m[field] for m in moments])[:length] for field in fields}


@contextmanager
def client_of(server, scheme, options=""):
    """A policy that asks a server; it is closed after the block."""
    policy = make_policy(f"{scheme}://{server.place}{options}", 0)
    yield policy
    policy.close()
