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


@given(hnp.arrays(np.float64, 8, elements=finite))
def test_an_action_of_eight_finite_numbers_passes_unchanged_as_array_or_list(action):
    assert np.array_equal(check_action(action), action)
    assert np.array_equal(check_action(action.tolist()), action)
    assert np.array_equal(check_chunk(action), action[None])


@given(
    hnp.arrays(
        np.float32, st.tuples(st.integers(1, 20), st.just(8)), elements=st.floats(-1, 1, width=32)
    )
)
def test_rows_of_actions_pass_unchanged_as_array_or_tensor(chunk):
    """Several rows of eight numbers are a chunk."""
    assert np.array_equal(check_chunk(chunk), chunk)
    # NumPy takes no tensor in bfloat16, with a gradient, or on a GPU.
    made = "detach.return_value.cpu.return_value.double.return_value.numpy.return_value"
    assert np.array_equal(check_chunk(MagicMock(**{made: chunk})), chunk)


@given(hnp.arrays(np.float64, hnp.array_shapes(min_dims=0, max_dims=3), elements=finite))
def test_an_action_of_another_shape_is_refused_with_its_shape(action):
    if action.shape != (8,):
        with pytest.raises(InvalidActionError, match=r"got shape"):
            check_action(action)


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
@pytest.mark.parametrize("column", [0, 7])
def test_a_value_that_is_nan_or_infinite_is_refused_with_its_row_and_column(bad, column):
    action = np.zeros(8)
    action[column] = bad
    with pytest.raises(InvalidActionError, match=f"value {column}: .* number, got {bad}"):
        check_action(action)

    chunk = np.zeros((3, 8))
    chunk[2, column] = bad
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
        ([[0.0] * 8, [0.0] * 7 + [True]], "value 7 of row 1: expected a finite number, got True"),
        ([True] * 8, "value 0: expected a finite number, got True"),
        ([np.zeros(8), np.zeros(8) > 0], "value 0 of row 1: expected a finite number, got False"),
        (array_masked_at((1, 3)), "value 3 of row 1: expected a finite number, got masked"),
        (list(array_masked_at((1, 3))), "value 3 of row 1: expected a finite number, got masked"),
        (array_masked_at((1, 3))[1], "value 3: expected a finite number, got masked"),
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
    tensor = MagicMock()
    cpu = tensor.detach.return_value.cpu.return_value
    cpu.is_floating_point.return_value = False
    cpu.numpy.return_value = np.ones((2, 8), bool)

    with pytest.raises(InvalidActionError, match="of dtype bool"):
        check_chunk(tensor)


@pytest.mark.parametrize("space", ACTION_SPACES.values(), ids=ACTION_SPACES)
def test_each_action_space_takes_actions_of_its_own_size(space):
    """It is found by its name; its lowest values are an action, and below its highest."""
    assert find_action_space(space.name) is space
    assert np.array_equal(check_chunk(space.low, space), space.low[None])
    assert (space.low < space.high).all()
    for check, wrong in ((check_action, space.size + 1), (check_chunk, space.size - 1)):
        with pytest.raises(InvalidActionError) as caught:
            check(np.zeros(wrong), space)
        for words in (f"({space.name})", f"{space.size}", space.describe, f"shape ({wrong},)"):
            assert words in str(caught.value)
    with pytest.raises(InvalidActionError, match=rf"\({space.name}\): .*array of {space.size}"):
        check_action("up", space)


@pytest.mark.parametrize("name", ["waypoints", "", None, ["ee_pose"]])
def test_unknown_action_spaces_are_named(name):
    with pytest.raises(UnknownNameError, match=r"There is no action space .*joint_angle, ee_pose"):
        find_action_space(name)


def test_the_arms_home_pose_lies_within_the_limits_of_actions():
    """As seven joint angles and a gripper, and as the pose of the tool: position, then angles."""
    home = np.array([0, 0, 0, -np.pi / 2, 0, np.pi / 2, np.pi / 4, 1])
    assert ((home >= JOINT_ANGLE.low) & (home <= JOINT_ANGLE.high)).all()

    tool_at_home = np.array([-0.0605, 0.0, 0.5211, -np.pi, 0.0, 0.0, 1.0])
    assert ((tool_at_home >= EE_POSE.low) & (tool_at_home <= EE_POSE.high)).all()
