"""Limits refuse what is outside and let through what is inside."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from roboirg.apps.real.control.limits import HIGH, LOW, Limits, read_limits
from roboirg.core.errors import InvalidActionError, InvalidValueError
from roboirg.core.kinematics import tool_pose

HOME = np.array([0.0, 0.0, 0.0, -np.pi / 2, 0.0, np.pi / 2, np.pi / 4])
PERIOD = 0.05
WIDE = Limits(workspace_low=(-2, -2, -2), workspace_high=(2, 2, 2))
shares = st.lists(st.floats(-1, 1), min_size=7, max_size=7).map(np.array)


def allowed(limits, target, last, joints):
    try:
        limits.check(np.append(target, 1.0), last, joints, PERIOD)
    except InvalidActionError:
        return False
    return True


@given(shares, st.floats(0.1, 3.0))
def test_speed_is_what_a_joint_does_in_a_period(share, speed):
    limits = WIDE.model_copy(update={"joint_speed": speed})
    step = speed * PERIOD
    target = HOME + 0.999 * share * step
    inside = np.all((target >= LOW) & (target <= HIGH))
    assert allowed(limits, target, HOME, HOME) == inside
    for joint in range(7):
        jump = HOME.copy()
        jump[joint] += 1.01 * step
        assert not allowed(limits, jump, HOME, HOME)


@given(shares)
def test_going_back_to_where_the_arm_is_is_not_fast(share):
    # The arm lags behind its target by more than a period's way.
    last = HOME + 0.3 * share
    if np.all((last >= LOW) & (last <= HIGH)):
        assert allowed(WIDE, HOME, last, HOME)
        assert allowed(WIDE, last, last, HOME)
        assert allowed(WIDE, (last + HOME) / 2, last, HOME)


@given(shares)
def test_the_tool_stays_in_the_workspace(share):
    target = (LOW + HIGH) / 2 + share * (HIGH - LOW) / 2
    limits = Limits(joint_speed=1e6)
    tool = tool_pose(target)[:3, 3]
    inside = np.all((tool >= limits.workspace_low) & (tool <= limits.workspace_high))
    assert allowed(limits, target, target, target) == inside


@pytest.mark.parametrize("joint", range(7))
def test_joints_stay_in_their_range(joint):
    for bound, sign in ((LOW, -1), (HIGH, 1)):
        target = HOME.copy()
        target[joint] = bound[joint]
        assert allowed(WIDE, target, target, target)
        target[joint] += sign * 0.001
        assert not allowed(WIDE, target, target, target)


def test_home_has_the_tool_in_the_middle_of_the_workspace():
    x, y, z = tool_pose(HOME)[:3, 3]
    assert (x, y, z) == pytest.approx((0.5545, 0.0, 0.5223), abs=0.01)


def test_limits_come_from_a_file(tmp_path):
    path = tmp_path / "limits.json"
    path.write_text('{"joint_speed": 0.5}')
    assert read_limits(path) == Limits(joint_speed=0.5)
    assert read_limits(None) == Limits()
    for text, words in (
        ('{"joint_sped": 1}', "joint_sped"),
        ('{"joint_speed": 0}', "joint_speed"),
        ("nothing", "the file"),
    ):
        path.write_text(text)
        with pytest.raises(InvalidValueError, match=words):
            read_limits(path)
    with pytest.raises(InvalidValueError, match="Cannot read the limits"):
        read_limits(tmp_path / "none.json")
