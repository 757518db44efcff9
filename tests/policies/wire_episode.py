"""A small made-up episode: what a policy is shown, with pictures of 8 x 8."""

import numpy as np

INSTRUCTION = "Put the Red cube on the target."


def picture(number, size=8, channel=0):
    values = np.arange(size * size * 3, dtype=np.int64) * (7 + channel) + 31 * number
    return (values % 251).astype(np.uint8).reshape(size, size, 3)


def moment(number, size=8, history=None):
    observation = {
        "front_rgb": picture(number, size),
        "wrist_rgb": picture(number, size, channel=1),
        "joint_positions": np.linspace(-1, 1, 7).astype(np.float32) + np.float32(number / 8),
        "gripper": np.array([0.04, 0.02], np.float32) / np.float32(1 + number),
        "end_effector": np.arange(6, dtype=np.float64) + number / 4,
        "instruction": INSTRUCTION,
    }
    if history is not None:
        observation["history"] = tuple(history)
    return observation


def video(length, size=8):
    """A demonstration of a given length."""
    moments = [moment(number, size) for number in range(length)] or [moment(0, size)]
    fields = ("front_rgb", "wrist_rgb", "joint_positions", "gripper", "end_effector")
    return {field: np.stack([m[field] for m in moments])[:length] for field in fields}
