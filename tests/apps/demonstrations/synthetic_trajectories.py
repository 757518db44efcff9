"""Trajectories without a simulator: short, with pictures that are easy to tell apart."""

import functools
import io
import zipfile

import numpy as np

from roboirg.apps.demonstrations.trajectory import TrajectoryFacts, write_arrays
from roboirg.apps.demonstrations.trajectory_recorder import PictureTracks
from roboirg.core.episode import ENVIRONMENT_VERSION
from roboirg.core.observations import CAMERAS, PICTURE_SIZE
from roboirg.util.atomic_write import replacing

STEPS = 7
"""With a video more than ten rows: the names of the last ones come before *2* by letters."""


def picture(camera, seed, row):
    """Return a picture with large areas and some noise."""
    rng = np.random.default_rng((CAMERAS.index(camera), seed, row))
    found = np.zeros((PICTURE_SIZE, PICTURE_SIZE, 3), np.uint8)
    found[:] = rng.integers(0, 256, 3)
    found[40:60, 10 * row % 200 : 10 * row % 200 + 30] = rng.integers(0, 256, (20, 30, 3))
    return found


def depth(seed, row):
    return np.full((PICTURE_SIZE, PICTURE_SIZE, 1), 400 + seed % 100 + row, np.int16)


def arrays_of(episode, rows, video_length, *, has_depth, disturbed=False):
    rng = np.random.default_rng(episode.seed)
    labels = ["pick up the cube"] * (rows // 2) + ["press the button"] * (rows - rows // 2)
    grounded = [f"{text} at <3, {row // 4}>" for row, text in enumerate(labels)]
    actions = rng.normal(size=(rows, 8)).astype(np.float32).astype(np.float64)
    arrays = {
        "joint_positions": rng.normal(size=(rows, 7)).astype(np.float32),
        "gripper": rng.uniform(0, 0.04, (rows, 2)).astype(np.float32),
        "end_effector": rng.normal(size=(rows, 6)),
        "actions": actions,
        "pose_actions": rng.normal(size=(rows, 7)),
        "subgoals": np.array(labels, np.str_),
        "online_subgoals": np.array(labels, np.str_),
        "grounded_subgoals": np.array(grounded, np.str_),
        "grounded_online_subgoals": np.array(grounded, np.str_),
    }
    if disturbed:
        arrays["labels"] = actions + 1.0
    for camera in CAMERAS if has_depth else ():
        arrays[f"{camera}_extrinsic"] = rng.normal(size=(rows, 3, 4)).astype(np.float32)
        arrays[f"{camera}_intrinsic"] = rng.normal(size=(3, 3)).astype(np.float32)
    return arrays


def record(episode, policy, path, spec, *, options=None, only_successes=True, **facts):
    """Stand in for `record_trajectory`; episode 1 of a task fails."""
    content, found = _recorded(episode, spec, only_successes, **facts)
    with replacing(path) as part:
        part.write_bytes(content)
    return found


@functools.cache
def _recorded(episode, spec, only_successes, policy_name="oracle", variation=0):
    status = "failure" if episode.index == 1 else "success"
    video_length = 4 if spec.video and episode.demonstration else 0
    rows = video_length + 1 + STEPS + variation
    facts = TrajectoryFacts(
        task=episode.task,
        split=episode.split,
        episode=episode.index,
        seed=episode.seed,
        difficulty=episode.difficulty,
        variation=variation,
        policy=policy_name,
        status=status,
        cause="" if status == "success" else "dropped the cube",
        video_length=video_length,
        steps=STEPS + variation,
        demonstration_source="planned" if video_length else "none",
        environment_version=ENVIRONMENT_VERSION,
        coding=spec.coding,
        depth=spec.depth,
        actions=spec.actions,
        disturbed=spec.disturbed,
    )
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w") as archive:
        if only_successes and status != "success":
            write_arrays(archive, facts, {})
        else:
            arrays = arrays_of(
                episode, rows, video_length, has_depth=spec.depth, disturbed=spec.disturbed
            )
            histograms = _write_pictures(archive, spec, episode.seed, rows)
            write_arrays(archive, facts, arrays | histograms)
    return file.getvalue(), facts


def _write_pictures(archive, spec, seed, rows):
    """Write pictures of all moments, and return how often each color is in them."""
    tracks = PictureTracks(archive, spec)
    for row in range(rows):
        seen = {}
        for camera in CAMERAS:
            seen[f"{camera}_rgb"] = picture(camera, seed, row)
            seen[f"{camera}_depth"] = depth(seed, row)
        tracks.add(seen)
    tracks.finish()
    return {f"{camera}_histogram": tracks.histograms[camera] for camera in spec.cameras}
