"""Recording and replaying in the simulator."""

import zipfile

import numpy as np
import pytest
from pyarrow import parquet

from roboirg.apps.demonstrations import export_run
from roboirg.apps.demonstrations.dataset_reading import read_dataset
from roboirg.apps.demonstrations.dataset_replay import replay
from roboirg.apps.demonstrations.export_plan import RecordingJob
from roboirg.apps.demonstrations.policy_choice import find_variation
from roboirg.apps.demonstrations.trajectory import load_trajectory, read_depth, read_picture
from roboirg.apps.demonstrations.trajectory_recorder import RecordingSpec, record_trajectory
from roboirg.envs.factory import make
from roboirg.policies import make_policy, play
from roboirg.policies.builtin.oracle_policy import VariedOraclePolicy
from roboirg.tasks.splits.splits import get_episode
from roboirg.util.media import scaled_square

pytestmark = pytest.mark.sim

EPISODE = ("VideoUnmask", "train", 0)


@pytest.mark.usefixtures("without_cache")
def test_pictures_are_the_simulators_bit_for_bit_and_actions_replay(tmp_path):
    """The same actions in a new world lead to the same pictures, states and verdict."""
    path, episode = tmp_path / "one.zip", get_episode(*EPISODE)
    spec = RecordingSpec(video=True, depth=True)
    facts = record_trajectory(episode, make_policy("oracle", 0), path, spec)
    assert facts.status == "success"
    recorded = load_trajectory(path)
    env = make(episode, depth=True, grounded=True)
    observation, info = env.reset()
    shown, first = info["demonstration"], facts.video_length
    assert first == shown.length > 0
    assert np.array_equal(recorded.actions[:first].astype(np.float32), shown.actions.astype("f4"))
    with zipfile.ZipFile(path) as archive:
        for row in range(0, first, 9):
            for camera in ("front", "wrist"):
                found = read_picture(archive, camera, row)
                assert np.array_equal(found, shown[f"{camera}_rgb"][row])
        for row in range(first, facts.rows):
            if row > first:
                observation, *_ = env.step(recorded.actions[row])
            for name in ("joint_positions", "gripper", "end_effector"):
                assert np.array_equal(getattr(recorded, name)[row], observation[name])
            if row % 9 == 0 or row == facts.rows - 1:
                for camera in ("front", "wrist"):
                    assert np.array_equal(
                        read_picture(archive, camera, row), observation[f"{camera}_rgb"]
                    )
                    assert np.array_equal(
                        read_depth(archive, camera, row), observation[f"{camera}_depth"]
                    )
    assert env.status == "success"
    assert recorded.grounded_online_subgoals[-1] == env.subgoal
    # The tool follows its targets with a delay, but ends where the last ones are.
    assert np.abs(recorded.pose_actions[-1, :3] - recorded.end_effector[-1, :3]).max() < 0.03


def test_small_pictures_are_the_simulators_scaled(tmp_path):
    path, episode = tmp_path / "one.zip", get_episode("StopCube", "train", 0)
    spec = RecordingSpec(cameras=("wrist",), size=64)
    assert record_trajectory(episode, make_policy("oracle", 0), path, spec).status == "success"
    recorded, env = load_trajectory(path), make(episode)
    with zipfile.ZipFile(path) as archive:
        names = {name for name in archive.namelist() if name.endswith(".png")}
        assert {name.partition("/")[0] for name in names} == {"wrist"}
        seen, _ = env.reset()
        for row in range(0, 30, 10):
            found = read_picture(archive, "wrist", row)
            assert np.array_equal(found, scaled_square(seen["wrist_rgb"], 64))
            seen, *_ = env.step_chunk(recorded.actions[row + 1 : row + 11])
    env.close()


def test_an_export_without_pictures_replays_exactly(tmp_path, make_plan):
    plan = make_plan(pictures="none", tasks=("StopCube",), episodes=(0,), settings=("explicit",))
    export_run.run_export(plan, tmp_path / "data", 0, lambda *_: None)
    (recorded,) = read_dataset(tmp_path / "data")
    result = replay(recorded)
    assert result.agrees
    assert (result.status, result.largest, result.final) == ("success", 0.0, 0.0)
    recorded.actions[len(recorded.actions) // 2 :, :7] += 0.2
    changed = replay(recorded)
    assert not changed.agrees
    assert changed.largest > 0.01


@pytest.mark.parametrize("actions", ["joint_angle", "waypoint"])
def test_a_disturbed_expert_is_labeled_by_what_it_meant_and_replays_exactly(
    tmp_path, make_plan, actions
):
    plan = make_plan(
        tasks=("VideoUnmask",), split="random", episodes=(3,), settings=("explicit",),
        pictures="none", actions=actions, disturbed=True,
    )  # fmt: skip
    export_run.run_export(plan, tmp_path / "data", 0, lambda *_: None)
    (recorded,) = read_dataset(tmp_path / "data")
    table = parquet.read_table(tmp_path / "data/data/chunk-000/file-000.parquet")
    labels = np.array(table["action"].to_pylist())
    differs = np.abs(labels - recorded.actions).max(axis=1) > 1e-6
    assert 0 < differs.sum() < len(differs)
    result = replay(recorded)
    assert (result.agrees, result.largest, result.final) == (True, 0.0, 0.0)


@pytest.mark.slow
def test_variations_differ_and_succeed():
    episode = get_episode("PickXtimes", "train", 0)
    steps = []
    for variation in (1, 2):
        job = RecordingJob("PickXtimes", "train", 0, variation, "oracle", None, RecordingSpec())
        seed = find_variation(job)
        env = make(episode, cameras=())
        info = play(env, VariedOraclePolicy(seed))
        assert info["status"] == "success"
        steps.append(info["steps"])
    env = make(episode, cameras=())
    steps.append(play(env, make_policy("oracle", 0))["steps"])
    assert len(set(steps)) == 3
