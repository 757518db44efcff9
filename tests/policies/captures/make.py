"""Writes the captures anew, with the codec of openpi itself instead of the benchmark's.

    pip install --no-deps --target /tmp/openpi openpi-client==0.1.2
    PYTHONPATH=/tmp/openpi:tests/policies python tests/policies/captures/make.py

What the messages hold is written out here once more, from the protocols' descriptions.
"""

from pathlib import Path

import numpy as np
from openpi_client.msgpack_numpy import packb
from wire_episode import INSTRUCTION, moment, video

demonstration = video(3)
now = moment(3)
later = moment(4)
latest = moment(5)


def state(joints, gripper):
    return np.array([*joints, gripper[0]], np.float32)


def frames(moments):
    return {
        "images": np.stack([m["front_rgb"][None] for m in moments]),
        "state": np.stack([state(m["joint_positions"], m["gripper"]) for m in moments]),
    }


def request(m, prompt, **more):
    return {
        "observation/image": m["front_rgb"],
        "observation/wrist_image": m["wrist_rgb"],
        "observation/state": state(m["joint_positions"], m["gripper"]),
        "prompt": prompt,
        **more,
    }


def challenge(moments, *, first):
    return {
        "task_goal": [INSTRUCTION],
        "is_first_step": first,
        "front_rgb_list": [m["front_rgb"] for m in moments],
        "wrist_rgb_list": [m["wrist_rgb"] for m in moments],
        "joint_state_list": [m["joint_positions"] for m in moments],
        "eef_state_list": [m["end_effector"] for m in moments],
        "gripper_state_list": [m["gripper"] for m in moments],
    }


def sensors(moments):
    return {
        "front_depth_list": [m["front_depth"] for m in moments],
        "wrist_depth_list": [m["wrist_depth"] for m in moments],
        "front_camera_extrinsic_list": [m["front_extrinsic"] for m in moments],
        "wrist_camera_extrinsic_list": [m["wrist_extrinsic"] for m in moments],
        "front_camera_intrinsic": moments[-1]["front_intrinsic"],
        "wrist_camera_intrinsic": moments[-1]["wrist_intrinsic"],
    }


seen = [moment(number, sensors=True) for number in range(6)]
subgoal = "pick up the red cube at <12, 34>"
before = [moment(number) for number in range(3)]
MESSAGES = {
    "openpi-1-infer": request(now, INSTRUCTION),
    "mme-vla-1-reset": {"reset": True},
    "mme-vla-2-buffer": {"add_buffer": True, **frames(before[:2]), "exec_start_idx": 3},
    "mme-vla-3-buffer": {"add_buffer": True, **frames([before[2], now]), "exec_start_idx": 0},
    "mme-vla-4-infer": request(now, INSTRUCTION.lower()),
    "mme-vla-5-buffer": {"add_buffer": True, **frames([later, latest]), "exec_start_idx": 0},
    "mme-vla-6-infer": request(latest, INSTRUCTION.lower(), grounded_subgoal=subgoal),
    "challenge-1-reset": {"reset": True},
    "challenge-2-infer": challenge([*before, now], first=True),
    "challenge-3-infer": challenge([later, latest], first=False),
    "challenge-sensors-1-reset": {"reset": True},
    "challenge-sensors-2-infer": {**challenge(seen[:4], first=True), **sensors(seen[:4])},
    "challenge-sensors-3-infer": {**challenge(seen[4:], first=False), **sensors(seen[4:])},
}

if __name__ == "__main__":
    for name, message in MESSAGES.items():
        Path(__file__).with_name(f"{name}.msgpack").write_bytes(packb(message))
