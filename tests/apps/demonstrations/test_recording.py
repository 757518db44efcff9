"""Recording and replaying in the simulator."""

import zipfile

import numpy as np
import pytest
from pyarrow import parquet

from roboirg.apps.demonstrations import export_run
from roboirg.apps.demonstrations.dataset_reading import read_dataset
from roboirg.apps.demonstrations.dataset_replay import replay
from roboirg.apps.demonstrations.trajectory import load_trajectory, read_depth, read_picture
from roboirg.apps.demonstrations.trajectory_recorder import RecordingSpec, record_trajectory
from roboirg.core.errors import MotionPlanningError
from roboirg.envs.factory import make
from roboirg.simulation.physics_settings import HOME_ACTION
from roboirg.tasks.splits.splits import get_episode

pytestmark = pytest.mark.sim


class Impatient:
    """Moves a little and gives up."""

    actions = "joint_angle"

    def reset(self, instruction, demonstration):
        self.rows = np.linspace(HOME_ACTION, HOME_ACTION + 0.2, 13)

    def act(self, observation):
        rows = self.rows
        self.rows = ()
        if len(rows) == 0:
            raise MotionPlanningError("It is too far.")
        return rows

    def close(self):
        self.rows = "closed"


@pytest.mark.parametrize(
    ("task", "spec"),
    [
        ("VideoUnmask", RecordingSpec(video=True, cameras=("front",))),
        ("PickXtimes", RecordingSpec(depth=True)),
    ],
)
def test_pictures_are_the_simulators_bit_for_bit_and_actions_replay(tmp_path, task, spec):
    """The same actions in a new world lead to the same pictures and states."""
    path = tmp_path / "one.zip"
    episode = get_episode(task, "train", 0)
    policy = Impatient()
    facts = record_trajectory(episode, policy, path, spec, only_successes=False)
    assert (facts.status, facts.cause, facts.steps) == ("failure", "It is too far.", 13)
    assert policy.rows == "closed"

    recorded = load_trajectory(path)
    start = facts.video_length
    env = make(
        episode, cameras=spec.cameras, depth=spec.depth, grounded=True, observe_every=1,
        demonstration_frames=9,
    )  # fmt: skip
    first, info = env.reset()
    video = info["demonstration"]
    last = env.step_chunk(recorded.actions[start + 1 :])[0]

    assert start == video.length
    assert np.array_equal(recorded.actions[:start].astype(np.float32), video.actions.astype("f4"))
    with zipfile.ZipFile(path) as archive:
        for camera in spec.cameras:
            for number, picture in enumerate(video[f"{camera}_rgb"]):
                assert np.array_equal(read_picture(archive, camera, 9 * number), picture)
        for row, seen in enumerate((first, *last["history"]), start):
            for name in ("joint_positions", "gripper", "end_effector"):
                assert np.array_equal(getattr(recorded, name)[row], seen[name])
            for camera in spec.cameras:
                assert np.array_equal(read_picture(archive, camera, row), seen[f"{camera}_rgb"])
                if spec.depth:
                    assert np.array_equal(read_depth(archive, camera, row), seen[f"{camera}_depth"])
    assert recorded.grounded_online_subgoals[-1] == env.subgoal
    # The tool follows its targets with a delay.
    assert np.abs(recorded.pose_actions[-1, :3] - recorded.end_effector[-1, :3]).max() < 0.15


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
    assert result.agrees
    assert (result.status, result.largest, result.final) == ("success", 0.0, 0.0)

    if actions == "joint_angle":
        recorded.actions[len(recorded.actions) // 2 :, :7] += 0.2
        changed = replay(recorded)
        assert (changed.agrees, changed.status) == (False, "failure")
        assert changed.largest > 0.01
