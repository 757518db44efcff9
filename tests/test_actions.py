"""Actions are checked once, with one sentence for each fault."""

from decimal import Decimal
from unittest.mock import MagicMock

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from roboirg.core.actions import (
    ACTION_SPACES,
    EE_POSE,
    JOINT_ANGLE,
    check_action,
    check_chunk,
    find_action_space,
)
from roboirg.core.errors import InvalidActionError, UnknownNameError

finite = st.floats(-10, 10)
actions = hnp.arrays(np.float64, 8, elements=finite)
chunks = hnp.arrays(
    np.float32, st.tuples(st.integers(1, 20), st.just(8)), elements=st.floats(-1, 1, width=32)
)
"""Several actions, a row each."""
other_shapes = hnp.array_shapes(min_dims=0, max_dims=3).filter(lambda shape: shape != (8,))


@given(actions)
def test_an_action_of_eight_finite_numbers_passes_unchanged_as_array_or_list(action):
    assert np.array_equal(check_action(action), action)
    assert np.array_equal(check_action(action.tolist()), action)


@given(actions)
def test_a_single_action_is_a_chunk_of_one_row(action):
    """An action is eight finite numbers."""
    assert np.array_equal(check_chunk(action), [action])


def tensor_of(array):
    """Return what NumPy takes only after these calls, as a tensor with a gradient or on a GPU."""
    tensor = MagicMock()
    cpu = tensor.detach.return_value.cpu.return_value
    cpu.is_floating_point.return_value = array.dtype != bool
    cpu.numpy.return_value = cpu.double.return_value.numpy.return_value = array
    return tensor


@given(chunks)
def test_rows_of_actions_pass_unchanged_as_array_or_tensor(chunk):
    """A chunk is several actions of eight numbers, a row each; `tensor_of` makes a stand-in for a
    tensor with a gradient or on a GPU."""
    assert np.array_equal(check_chunk(chunk), chunk)
    assert np.array_equal(check_chunk(tensor_of(chunk)), chunk)


@given(hnp.arrays(np.float64, other_shapes, elements=finite))
def test_an_action_of_another_shape_is_refused_with_its_shape(action):
    """Any shape but (8,), the one of an action."""
    with pytest.raises(InvalidActionError, match="got shape"):
        check_action(action)


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
@pytest.mark.parametrize("column", [0, 7])
def test_a_value_that_is_nan_or_infinite_is_refused_with_its_row_and_column(bad, column):
    chunk = np.zeros((3, 8))
    chunk[2, column] = bad

    with pytest.raises(InvalidActionError, match=f"value {column}: .* number, got {bad}"):
        check_action(chunk[2])
    with pytest.raises(InvalidActionError, match=f"value {column} of row 2: .*, got {bad}"):
        check_chunk(chunk)


@pytest.mark.parametrize(
    ("bad", "got"),
    [("open", "str"), (None, "NoneType"), ({"a": 1}, "dict"),
     (np.zeros(8, complex), "ndarray of dtype complex128"), (np.zeros((0, 8)), r"shape \(0, 8\)"),
     ([[1, 2], [3]], "rows of different lengths"), ([10**400] * 8, "list of dtype o")],
)  # fmt: skip
def test_what_is_not_an_array_of_numbers_is_refused(bad, got):
    with pytest.raises(InvalidActionError, match=f"got {got}"):
        check_chunk(bad)


def array_masked_at(place):
    array = np.ma.array(np.zeros((3, 8)))
    array[place] = np.ma.masked
    return array


@pytest.mark.parametrize(
    ("bad", "got"),
    [
        (np.zeros((2, 8)) > 0, "got ndarray of dtype bool"),
        ([np.zeros(8), np.zeros(8) > 0], "value 0 of row 1: expected a finite number, got False"),
        (array_masked_at((1, 3)), "value 3 of row 1: expected a finite number, got masked"),
        ([0.0] * 7 + [None], "value 7: expected a finite number, got None"),
        (
            [[0.0] * 8, [Decimal("0.5")] + [0.0] * 7],
            r"value 0 of row 1: expected a finite number, got Decimal\('0.5'\)",
        ),
        ([["1"] * 8], "value 0 of row 0: expected a finite number, got '1'"),
        ([0.0, 1j] + [0.0] * 6, "value 1: expected a finite number, got 1j"),
        (np.array([0.0, {}] * 4, object), "value 1: expected a finite number, got {}"),
    ],
)
def test_a_flag_a_masked_value_or_no_number_is_refused_with_its_place(bad, got):
    """NumPy would take True for 1, and a masked value for the number below its mask."""
    with pytest.raises(InvalidActionError, match=got):
        check_chunk(bad)


def test_a_masked_array_without_masked_values_is_an_action():
    assert np.array_equal(check_chunk(np.ma.array(np.ones((2, 8)))), np.ones((2, 8)))


def test_a_tensor_of_flags_is_refused():
    """`tensor_of` makes a stand-in for a tensor, here of true and false."""
    with pytest.raises(InvalidActionError, match="of dtype bool"):
        check_chunk(tensor_of(np.ones((2, 8), bool)))


each_space = pytest.mark.parametrize("space", ACTION_SPACES.values(), ids=ACTION_SPACES)


@each_space
def test_the_lowest_values_of_an_action_space_are_an_action_below_its_highest(space):
    assert np.array_equal(check_chunk(space.low, space), [space.low])
    assert (space.low < space.high).all()


@each_space
@pytest.mark.parametrize("check", [check_action, check_chunk])
def test_an_action_of_another_size_than_its_space_s_is_refused(space, check):
    """With the name and the size of the space, what its numbers are, and the shape."""
    with pytest.raises(InvalidActionError) as caught:
        check(np.zeros(space.size + 1), space)

    message = str(caught.value)
    assert f"({space.name})" in message
    assert f"{space.size}" in message
    assert space.describe in message
    assert f"shape ({space.size + 1},)" in message


@pytest.mark.parametrize("name", ["waypoints", "", None, ["ee_pose"]])
def test_unknown_action_spaces_are_named(name):
    """Names that are nearly one, empty, or no text at all: the sentence lists those that exist."""
    with pytest.raises(UnknownNameError, match=r"There is no action space .*joint_angle, ee_pose"):
        find_action_space(name)


def test_the_arms_home_pose_lies_within_the_limits_of_actions():
    """As seven joint angles and a gripper, and as the pose of the tool: position, then angles."""
    home = np.array([0, 0, 0, -np.pi / 2, 0, np.pi / 2, np.pi / 4, 1])
    assert ((home >= JOINT_ANGLE.low) & (home <= JOINT_ANGLE.high)).all()

    tool_at_home = np.array([-0.0605, 0.0, 0.5211, -np.pi, 0.0, 0.0, 1.0])
    assert ((tool_at_home >= EE_POSE.low) & (tool_at_home <= EE_POSE.high)).all()
