"""The twin is the simulator: what is played on it through the loop is what simulation plays."""

import numpy as np
import pytest

from roboirg.apps.real.control.clock import VirtualClock
from roboirg.apps.real.control.limits import Limits
from roboirg.apps.real.control.robot import CAMERA_RATE, JudgingRobot
from roboirg.apps.real.control.twin import Twin
from roboirg.apps.real.study.study_plan import make_study
from roboirg.apps.real.study.study_run import Study
from roboirg.core.kinematics import end_effector_pose, tool_pose
from roboirg.evaluation.play.rollout import EpisodeRunner
from roboirg.evaluation.records.record import NON_DETERMINISTIC_FIELDS

pytestmark = pytest.mark.sim


@pytest.mark.slow
@pytest.mark.parametrize("task", ["PutInBox", "PickByCount"])
def test_a_trial_on_the_twin_is_the_episode_of_simulation(task, tmp_path):
    plan = make_study(
        ("listener", "forgetful"), tasks=(task,), settings=("spatial",), trials=1, demonstrations=0
    )
    played = Study(plan, tmp_path, Twin(), scorer="judge").run()
    assert len(played) == 2
    for record in played:
        simulated = EpisodeRunner(tmp_path)(record.identity)
        # A trial asks ahead: it does not count calls, and keeps no rows of them.
        apart = {"policy_metadata", "calls", "action_log", "end_state", *NON_DETERMINISTIC_FIELDS}
        ours, theirs = (
            {name: getattr(one, name) for name in one.__struct_fields__ if name not in apart}
            for one in (record, simulated)
        )
        assert ours == theirs
        assert record.outcome in ("success", "failure")
        assert record.policy_metadata["real_trial"]["robot"] == "twin"
        assert record.policy_metadata["real_trial"]["held"] == 0


def test_the_tool_is_where_the_joints_say():
    twin = Twin()
    plan = make_study(("random",), tasks=("PutInBox",), settings=("explicit",), trials=1)
    twin.prepare(plan.trials[0].job, ())
    rng = np.random.default_rng(0)
    for _ in range(20):
        joints = twin.observe().joints
        command = np.append(joints + rng.uniform(-0.07, 0.07, 7), 1.0)
        twin.command(command)
        sensed = twin.observe()
        told, found = np.asarray(sensed.fields["end_effector"]), end_effector_pose(sensed.joints)
        assert np.allclose(told[:3], found[:3], atol=1e-4)
        turned = (told[3:] - found[3:] + np.pi) % (2 * np.pi) - np.pi
        assert np.allclose(turned, 0.0, atol=1e-3)
        assert np.allclose(tool_pose(sensed.joints)[:3, 3] - [0.615, 0, 0], told[:3], atol=1e-4)


def test_cameras_take_pictures_at_their_rate_and_draw_what_is_read():
    clock = VirtualClock()
    twin = Twin(clock)
    plan = make_study(("random",), tasks=("PickByCount",), settings=("explicit",), trials=1)
    twin.prepare(plan.trials[0].job, ("front", "wrist"))
    moments = set()
    for _ in range(300):
        clock.wait_until(clock.now() + 0.01)
        taken = twin.observe().taken
        assert set(taken) == {"front", "wrist"}
        assert -1e-6 <= clock.now() - taken["front"] <= 1.0 / CAMERA_RATE + 1e-6
        moments.add(round(taken["front"], 6))
    assert len(moments) == pytest.approx(3.0 * CAMERA_RATE, abs=1)
    fields = twin.observe().fields
    assert fields["front_rgb"].shape == fields["wrist_rgb"].shape == (256, 256, 3)
    assert fields["front_depth"].shape == (256, 256, 1)
    assert len(np.unique(fields["front_rgb"])) > 10
    assert "wrist_depth" not in fields
    twin.close()


@pytest.mark.slow
def test_the_twin_judges_and_its_commands_are_within_the_limits(tmp_path):
    assert isinstance(Twin(), JudgingRobot)
    plan = make_study(("oracle",), tasks=("PickByCount",), settings=("explicit",), trials=8)
    # Limits half as wide as the usual speed: the hands stay below 0.9 rad/s.
    records = Study(plan, tmp_path, Twin(), Limits(joint_speed=1.0), scorer="judge").run()
    assert [record.outcome for record in records] == ["success"] * 8
