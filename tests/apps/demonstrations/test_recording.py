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


def test_a_policy_that_gives_up_has_its_trajectory_as_a_failure(tmp_path):
    """`Impatient` moves for 13 steps, then raises an error, whose words are the cause.

    It is closed, which sets its `rows` to "closed".
    """
    policy = Impatient()
    episode = get_episode("PickXtimes", "train", 0)

    facts = record_trajectory(
        episode, policy, tmp_path / "one.zip", RecordingSpec(), only_successes=False
    )

    assert (facts.status, facts.cause, facts.steps) == ("failure", "It is too far.", 13)
    assert policy.rows == "closed"


def test_recorded_pictures_and_states_are_those_of_the_same_actions_in_a_new_world(tmp_path):
    """`Impatient` moves for 13 steps, so a recording has 14 rows: the reset, which has no action,
    and the moment after each step. A new environment executes the same actions.

    What it shows is equal bit for bit: states, colors and depths of both cameras.
    """
    path = tmp_path / "one.zip"
    episode = get_episode("PickXtimes", "train", 0)
    record_trajectory(episode, Impatient(), path, RecordingSpec(depth=True), only_successes=False)
    recorded = load_trajectory(path)

    env = make(episode, depth=True, grounded=True, observe_every=1, demonstration_frames="none")
    first, _ = env.reset()
    last, *_ = env.step_chunk(recorded.actions[1:])
    observations = [first, *last["history"]]

    for name in ("joint_positions", "gripper", "end_effector"):
        seen = [observation[name] for observation in observations]
        assert np.array_equal(getattr(recorded, name), seen), name
    with zipfile.ZipFile(path) as archive:
        for row, seen in enumerate(observations):
            for camera in ("front", "wrist"):
                assert np.array_equal(read_picture(archive, camera, row), seen[f"{camera}_rgb"])
                assert np.array_equal(read_depth(archive, camera, row), seen[f"{camera}_depth"])
    assert recorded.grounded_online_subgoals[-1] == env.subgoal


def test_the_recorded_video_is_that_of_the_environment(tmp_path):
    """All pictures are recorded; the environment shows every ninth, so its number n is row 9 * n.

    Actions are those of the video's steps, as 32-bit floats.
    """
    path = tmp_path / "one.zip"
    episode = get_episode("VideoUnmask", "train", 0)
    spec = RecordingSpec(video=True, cameras=("front",))
    facts = record_trajectory(episode, Impatient(), path, spec, only_successes=False)

    _, info = make(episode, cameras=("front",), demonstration_frames=9).reset()

    video = info["demonstration"]
    assert facts.video_length == video.length
    actions = load_trajectory(path).actions[: video.length]
    assert np.array_equal(actions.astype(np.float32), video.actions.astype(np.float32))
    with zipfile.ZipFile(path) as archive:
        for number, picture in enumerate(video["front_rgb"]):
            assert np.array_equal(read_picture(archive, "front", 9 * number), picture)


@pytest.fixture(params=["joint_angle", "waypoint"])
def disturbed(tmp_path, make_plan, request):
    """The folder of one exported episode of a disturbed expert, and its actions' kind."""
    plan = make_plan(
        tasks=("VideoUnmask",), split="random", episodes=(3,), settings=("explicit",),
        pictures="none", actions=request.param, disturbed=True,
    )  # fmt: skip
    export_run.run_export(plan, tmp_path / "data", 0, lambda *_: None)
    return tmp_path / "data"


def test_a_disturbed_expert_is_labeled_by_what_it_meant_and_replays_exactly(disturbed):
    """A disturbed expert moves a little elsewhere than it meant to, now and then. The label
    `action` is what it meant: in some steps it differs from what was executed (by more than 1e-6),
    but not in all.

    The replay executes what was executed, so it ends with the same verdict and no difference.
    """
    (recorded,) = read_dataset(disturbed)
    table = parquet.read_table(disturbed / "data/chunk-000/file-000.parquet")
    labels = np.array(table["action"].to_pylist())

    result = replay(recorded)

    differs = np.abs(labels - recorded.actions).max(axis=1) > 1e-6
    assert 0 < differs.sum() < len(differs)
    assert result.agrees
    assert (result.status, result.largest, result.final) == ("success", 0.0, 0.0)


def test_the_replay_of_changed_actions_does_not_agree(tmp_path, make_plan):
    """The seven joints' targets of the second half are moved by 0.2 rad, so the task fails.

    The states then differ by more than 0.01 rad.
    """
    plan = make_plan(
        tasks=("VideoUnmask",), split="random", episodes=(3,), settings=("explicit",),
        pictures="none",
    )  # fmt: skip
    export_run.run_export(plan, tmp_path / "data", 0, lambda *_: None)
    (recorded,) = read_dataset(tmp_path / "data")

    recorded.actions[len(recorded.actions) // 2 :, :7] += 0.2
    result = replay(recorded)

    assert (result.agrees, result.status) == (False, "failure")
    assert result.largest > 0.01
