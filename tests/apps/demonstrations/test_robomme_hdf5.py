"""RoboMME's format, read as MME-VLA's builder does: by its documented layout."""

import json

import numpy as np
import pytest
import synthetic_trajectories as synthetic

from roboirg.apps.demonstrations.dataset_reading import read_dataset
from roboirg.language import instruct
from roboirg.tasks.splits.splits import get_episode

h5py = pytest.importorskip("h5py")

SHAPES = {
    "obs/front_rgb": ("uint8", (256, 256, 3)),
    "obs/wrist_rgb": ("uint8", (256, 256, 3)),
    "obs/front_depth": ("int16", (256, 256, 1)),
    "obs/wrist_depth": ("int16", (256, 256, 1)),
    "obs/front_camera_extrinsic": ("float32", (3, 4)),
    "obs/wrist_camera_extrinsic": ("float32", (3, 4)),
    "obs/joint_state": ("float32", (7,)),
    "obs/eef_state": ("float32", (6,)),
    "obs/gripper_state": ("float32", (2,)),
    "obs/is_gripper_close": ("bool", ()),
    "action/joint_action": ("float64", (8,)),
    "action/eef_action": ("float64", (7,)),
    "action/waypoint_action": ("float64", (7,)),
    "info/is_video_demo": ("bool", ()),
    "info/is_subgoal_boundary": ("bool", ()),
    "info/is_completed": ("bool", ()),
}
TEXTS = ("simple_subgoal", "simple_subgoal_online", "grounded_subgoal", "grounded_subgoal_online")


def read_like_mme_vla(path):
    """Yield the samples of each episode: those of its execution frames."""
    with h5py.File(path, "r") as file:
        for name in sorted(file, key=lambda one: int(one.split("_")[1])):
            episode = file[name]
            steps = sorted(
                (one for one in episode if one.startswith("timestep_")),
                key=lambda one: int(one.split("_")[1]),
            )
            assert steps[0] == "timestep_0"
            goal = [one.decode() for one in episode["setup/task_goal"][()]]
            frames = []
            for step in steps:
                obs, action, info = (episode[step][kind] for kind in ("obs", "action", "info"))
                frames.append(
                    {
                        "image": obs["front_rgb"][()],
                        "wrist_image": obs["wrist_rgb"][()],
                        "state": np.append(obs["joint_state"][()], obs["gripper_state"][()][0]),
                        "action": action["joint_action"][()],
                        "is_demo": bool(info["is_video_demo"][()]),
                        "subgoals": {text: info[text][()].decode() for text in TEXTS},
                        "is_boundary": bool(info["is_subgoal_boundary"][()]),
                        "is_closed": bool(obs["is_gripper_close"][()]),
                    }
                )
            yield int(episode["setup/seed"][()]), goal, frames


def test_time_steps_have_robommes_fields_and_a_builder_reads_what_was_recorded(export):
    root = export(format="robomme-hdf5", video=True, settings=("explicit",))
    with h5py.File(root / "record_dataset_VideoUnmask.h5", "r") as file:
        assert sorted(file) == ["episode_0", "episode_2"]
        for step in file["episode_0"]:
            if step == "setup":
                continue
            for name, (kind, shape) in SHAPES.items():
                found = file["episode_0"][step][name]
                assert (found.dtype, found.shape) == (np.dtype(kind), shape), name
            choice = json.loads(file["episode_0"][step]["action/choice_action"][()])
            assert choice == {"choice": "", "point": []}
        setup = file["episode_0/setup"]
        episode = get_episode("VideoUnmask", "train", 0)
        assert setup["difficulty"][()].decode() == episode.difficulty
        assert setup["front_camera_intrinsic"].shape == (3, 3)
    for task, video in (("PickXtimes", 0), ("VideoUnmask", 4)):
        found = list(read_like_mme_vla(root / f"record_dataset_{task}.h5"))
        assert len(found) == 2
        for index, (seed, goal, frames) in zip((0, 2), found, strict=True):
            episode = get_episode(task, "train", index)
            assert (seed, goal) == (episode.seed, [instruct(episode).text])
            rows = video + 1 + synthetic.STEPS
            expected = synthetic.arrays_of(episode, rows, video, has_depth=True)
            # The policy's first observation, which follows the way home, is no time step.
            kept = [row for row in range(rows) if row != video]
            assert len(frames) == len(kept)
            for row, frame in zip(kept, frames, strict=True):
                assert np.array_equal(frame["image"], synthetic.picture("front", episode.seed, row))
                assert np.array_equal(
                    frame["wrist_image"], synthetic.picture("wrist", episode.seed, row)
                )
                assert np.array_equal(frame["action"], expected["actions"][row])
                assert np.array_equal(frame["state"][:7], expected["joint_positions"][row])
                assert frame["is_demo"] == (row < video)
                assert frame["is_closed"] == (expected["gripper"][row].min() < 0.03)
                assert frame["subgoals"]["grounded_subgoal"] == expected["grounded_subgoals"][row]
            labels = [(frame["is_demo"], frame["subgoals"]["simple_subgoal"]) for frame in frames]
            changes = [i == 0 or labels[i] != labels[i - 1] for i in range(len(labels))]
            assert [frame["is_boundary"] for frame in frames] == changes


def test_several_settings_share_their_time_steps_and_actions_are_found_by_seed(export):
    root = export(format="robomme-hdf5", video=True)
    goals = []
    for folder in ("explicit-implicit", "direct-implicit"):
        path = root / folder / "record_dataset_PickXtimes.h5"
        assert path.stat().st_size < 200_000
        found = list(read_like_mme_vla(path))
        assert [len(frames) for *_, frames in found] == [synthetic.STEPS] * 2
        goals.append(found[0][1])
    assert goals[0] != goals[1]
    recorded = [one for one in read_dataset(root) if one.task == "VideoUnmask"]
    episode, other = (get_episode("VideoUnmask", "train", index) for index in (0, 2))
    assert [one.seed for one in recorded] == [episode.seed, other.seed]
    expected = synthetic.arrays_of(episode, 4 + 1 + synthetic.STEPS, 4, has_depth=True)
    assert np.array_equal(recorded[0].actions, expected["actions"][5:])
    assert np.array_equal(recorded[0].states[:, :7], expected["joint_positions"][5:])
