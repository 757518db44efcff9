"""The tool's angles: those that SciPy gives, to the last bit."""

import warnings

import numpy as np
import pytest
import sapien
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from roboirg.simulation.proprioception import euler_angles, unwrap_angles

quaternion_part = st.floats(-1.0, 1.0, width=32) | st.sampled_from(
    [0.0, -0.0, 1.0, -1.0, 0.5, -0.5]
)


def angles_by_scipy(pose):
    w, x, y, z = np.asarray(pose.q, dtype=np.float64)
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", message="Gimbal lock")
        return Rotation.from_quat([x, y, z, w]).as_euler("xyz")


def check_angles(quaternion):
    assume(np.linalg.norm(quaternion) > 1e-3)
    pose = sapien.Pose(q=quaternion)
    assert euler_angles(pose).tobytes() == angles_by_scipy(pose).tobytes()


quaternions = st.tuples(quaternion_part, quaternion_part, quaternion_part, quaternion_part)


@given(quaternions)
def test_euler_angles_are_bit_identical_to_scipy_s(quaternion):
    check_angles(quaternion)


any_angle = st.floats(-50.0, 50.0) | st.integers(-40, 40).map(
    lambda quaternion_part: quaternion_part * np.pi / 4
)


@settings(max_examples=100)
@given(any_angle, any_angle)
def test_an_angle_is_continued_without_a_jump_as_by_numpy_unwrap(before, now):
    ours = unwrap_angles(np.array([before]), np.array([now]))

    assert ours.tobytes() == np.unwrap([before, now])[1:].tobytes()


@pytest.mark.parametrize("spread", [1.0, 1e-3, 1e-7])
@pytest.mark.parametrize("around", [(0, 1, 0, 0), (1, 0, 1, 0), (1, 0, -1, 0), (0, 1, 0, -1)])
def test_euler_angles_near_a_gimbal_lock_are_bit_identical_to_scipy_s(around, spread):
    """At a gimbal lock two of the three angles can be exchanged, and rounding decides."""
    rng = np.random.default_rng(0)
    for offset in rng.normal(0.0, spread, (300, 4)):
        pose = sapien.Pose(q=np.array(around) + offset)
        assert euler_angles(pose).tobytes() == angles_by_scipy(pose).tobytes()
