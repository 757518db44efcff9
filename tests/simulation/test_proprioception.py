"""The tool's angles: those that SciPy and NumPy give, to the last bit."""

import warnings

import numpy as np
import pytest
import sapien
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from roboirg.simulation.proprioception import euler_angles, unwrap_angles


def angles_by_scipy(pose):
    w, x, y, z = np.asarray(pose.q, dtype=np.float64)
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", message="Gimbal lock")
        return Rotation.from_quat([x, y, z, w]).as_euler("xyz")


parts = st.floats(-1.0, 1.0, width=32) | st.sampled_from([0.0, -0.0, 1.0, -1.0, 0.5, -0.5])
quaternions = st.tuples(parts, parts, parts, parts).filter(lambda q: np.linalg.norm(q) > 1e-3)


@given(quaternions)
def test_euler_angles_are_bit_identical_to_scipy_s(quaternion):
    """The pose has any turn, written as four numbers; SciPy's angles for it are the reference, and
    not a bit may differ."""
    pose = sapien.Pose(q=quaternion)

    assert euler_angles(pose).tobytes() == angles_by_scipy(pose).tobytes()


@pytest.mark.parametrize("spread", [1.0, 1e-3, 1e-7])
@pytest.mark.parametrize("locked", [(0, 1, 0, 0), (1, 0, 1, 0)])
def test_euler_angles_near_a_gimbal_lock_are_bit_identical_to_scipy_s(locked, spread):
    """At a gimbal lock two of the three angles can be exchanged, and rounding decides."""
    rng = np.random.default_rng(0)
    for offset in rng.normal(0.0, spread, (300, 4)):
        pose = sapien.Pose(q=locked + offset)

        assert euler_angles(pose).tobytes() == angles_by_scipy(pose).tobytes(), pose.q


radians = st.floats(-50.0, 50.0) | st.integers(-40, 40).map(lambda eighths: eighths * np.pi / 4)


@settings(max_examples=100)
@given(radians, radians)
def test_an_angle_is_continued_without_a_jump(before, now):
    """After 3.1 rad comes 3.2 and not -3.08, which is the same angle: the result differs from `now`
    by whole turns, and from `before` by at most half a turn."""
    (continued,) = unwrap_angles(np.array([before]), np.array([now]))

    turns = (continued - now) / (2 * np.pi)
    assert turns == pytest.approx(round(turns), abs=1e-9)
    assert abs(continued - before) <= np.pi + 1e-9
