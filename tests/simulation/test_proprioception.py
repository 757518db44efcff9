"""The tool's angles: those that SciPy gives, to the last bit."""

import warnings

import numpy as np
import pytest
import sapien
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from roboirg.simulation.proprioception import euler_angles, unwrap_angle

number = st.floats(-1.0, 1.0, width=32) | st.sampled_from([0.0, -0.0, 1.0, -1.0, 0.5, -0.5])


def angles_by_scipy(pose):
    w, x, y, z = np.asarray(pose.q, dtype=np.float64)
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", message="Gimbal lock")
        return Rotation.from_quat([x, y, z, w]).as_euler("xyz")


def check_angles(quaternion):
    assume(np.linalg.norm(quaternion) > 1e-3)
    pose = sapien.Pose(q=quaternion)
    assert euler_angles(pose).tobytes() == angles_by_scipy(pose).tobytes()


quaternions = st.tuples(number, number, number, number)


@given(quaternions)
def test_angles_are_those_of_scipy(quaternion):
    check_angles(quaternion)


turned = st.floats(-50.0, 50.0) | st.integers(-40, 40).map(lambda number: number * np.pi / 4)


@settings(max_examples=100)
@given(turned, turned)
def test_angles_without_turns_are_those_of_numpy(before, now):
    ours = np.float64(unwrap_angle(before, now))
    assert ours.tobytes() == np.unwrap([before, now])[1].tobytes()


@pytest.mark.parametrize("spread", [1.0, 1e-3, 1e-7])
@pytest.mark.parametrize("around", [(0, 1, 0, 0), (1, 0, 1, 0), (1, 0, -1, 0), (0, 1, 0, -1)])
def test_angles_near_where_they_jump_are_those_of_scipy(around, spread):
    rng = np.random.default_rng(0)
    for offset in rng.normal(0.0, spread, (300, 4)):
        pose = sapien.Pose(q=np.array(around) + offset)
        assert euler_angles(pose).tobytes() == angles_by_scipy(pose).tobytes()
