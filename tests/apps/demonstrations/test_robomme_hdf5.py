"""RoboMME's format, read as MME-VLA's builder does: by its documented layout."""

import json

import numpy as np
import pytest
import synthetic_trajectories as synthetic

from roboirg.language import instruct
from roboirg.tasks.splits.splits import get_episode

h5py = pytest.importorskip("h5py")


def time_steps(file, name):
    """Return the time steps of an episode in their order, as MME-VLA's builder finds them."""
    steps = [step for step in file[name] if step.startswith("timestep_")]
    return [file[name][step] for step in sorted(steps, key=lambda step: int(step[9:]))]


def test_time_steps_have_robommes_fields(export):
    """RoboMME documents the type and the shape of each field of a time step; depths are in mm.

    A choice of action is always empty JSON here. The first time step of an export is looked at.
    """
    root = export(format="robomme-hdf5", video=True, settings=("explicit",))

    with h5py.File(root / "record_dataset_VideoUnmask.h5", "r") as file:
        step = file["episode_0/timestep_0"]
        for name, (kind, shape) in {
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
        }.items():
            assert (step[name].dtype, step[name].shape) == (np.dtype(kind), shape), name
        assert json.loads(step["action/choice_action"][()]) == {"choice": "", "point": []}


def test_an_episode_has_its_seed_goal_difficulty_and_camera(export):
    """The setup of an episode has the seed and the difficulty of its scene, the instruction as its
    goal, and the matrix of the front camera.

    Synthetic episodes 0 and 2 of three succeed; episode 1 fails and is not there.
    """
    episode = get_episode("VideoUnmask", "train", 0)
    root = export(format="robomme-hdf5", video=True, settings=("explicit",))

    with h5py.File(root / "record_dataset_VideoUnmask.h5", "r") as file:
        assert sorted(file) == ["episode_0", "episode_2"]
        setup = file["episode_0/setup"]
        assert setup["seed"][()] == episode.seed
        assert [text.decode() for text in setup["task_goal"][()]] == [instruct(episode).text]
        assert setup["difficulty"][()].decode() == episode.difficulty
        assert setup["front_camera_intrinsic"].shape == (3, 3)


@pytest.mark.parametrize(
    ("task", "video", "kept_rows"),
    [
        ("PickXtimes", 0, [1, 2, 3, 4, 5, 6, 7]),
        ("VideoUnmask", 4, [0, 1, 2, 3, 5, 6, 7, 8, 9, 10, 11]),
    ],
)
def test_time_steps_have_what_was_recorded_but_for_the_moment_of_the_reset(
    export, task, video, kept_rows
):
    """A synthetic episode has rows of its video (four or none), one at the reset, and seven of the
    policy. The row at the reset is no time step, as no action leads to it.

    Fingers open to 0.04 m each; below 0.03 m RoboMME's format calls the gripper closed.
    """
    episode = get_episode(task, "train", 2)
    recorded = synthetic.arrays_of(episode, video + 1 + 7, video, has_depth=True)
    root = export(format="robomme-hdf5", video=True, settings=("explicit",))

    with h5py.File(root / f"record_dataset_{task}.h5", "r") as file:
        for row, step in zip(kept_rows, time_steps(file, "episode_2"), strict=True):
            expected = {
                "obs/front_rgb": synthetic.picture("front", episode.seed, row),
                "obs/joint_state": recorded["joint_positions"][row],
                "obs/is_gripper_close": recorded["gripper"][row].min() < 0.03,
                "action/joint_action": recorded["actions"][row],
                "info/grounded_subgoal": recorded["grounded_subgoals"][row].encode(),
            }
            for name, value in expected.items():
                assert np.array_equal(step[name][()], value), (row, name)


@pytest.fixture
def flags_of_steps(export):
    """Return the numbers of the time steps of which a flag is true, in a synthetic episode.

    The episode has four steps of video, then seven of the policy; from the policy's second one on,
    it has another subgoal.
    """
    root = export(format="robomme-hdf5", video=True, settings=("explicit",))

    def flagged(name):
        with h5py.File(root / "record_dataset_VideoUnmask.h5", "r") as file:
            steps = time_steps(file, "episode_2")
            return [number for number, step in enumerate(steps) if step[f"info/{name}"][()]]

    return flagged


def test_the_steps_of_the_video_are_marked(flags_of_steps):
    """The first four of the synthetic episode's eleven steps are of its video."""
    assert flags_of_steps("is_video_demo") == [0, 1, 2, 3]


def test_a_boundary_is_where_an_episode_or_its_policy_or_another_subgoal_begins(flags_of_steps):
    """The policy begins at step 4, after four steps of video, and its subgoal changes at step 5."""
    assert flags_of_steps("is_subgoal_boundary") == [0, 4, 5]


def test_each_setting_has_a_file_with_its_own_words_and_shared_time_steps(export):
    """Each file links to the time steps of one shared file: it is below 200 kB, with them larger.

    The goal, which is the instruction, differs between the two settings.
    """
    root = export(format="robomme-hdf5", video=True)

    goals = set()
    for folder in ("explicit-implicit", "direct-implicit"):
        path = root / folder / "record_dataset_PickXtimes.h5"
        assert path.stat().st_size < 200_000
        with h5py.File(path, "r") as file:
            assert len(time_steps(file, "episode_0")) == synthetic.STEPS
            goals.add(file["episode_0/setup/task_goal"][0])

    assert len(goals) == 2
