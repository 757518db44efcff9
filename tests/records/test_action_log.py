"""Action logs: what is written is what is read, and nothing else is read."""

import io
import os

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from roboirg.core.errors import InvalidValueError
from roboirg.records.action_log import (
    ActionLog,
    action_path,
    read_actions,
    write_actions,
)
from roboirg.records.record_codec import StoreError

finite = st.floats(-1e6, 1e6)


@st.composite
def any_action_logs(draw):
    """Draw a log of up to seven answers of a policy, of 1 to 5 executed actions each.

    Nothing may be executed of the last answer. Some logs have numbers in single precision.
    """
    lengths = draw(st.lists(st.integers(1, 5), max_size=6)) + draw(st.sampled_from([[], [0]]))
    rows = draw(arrays(np.float64, (sum(lengths), 8), elements=finite))
    if draw(st.booleans()):
        rows = rows.astype(np.float32).astype(np.float64)
    starts = np.cumsum([0, *lengths], dtype=np.int32)[:-1]
    end = draw(arrays(np.float64, st.integers(0, 9), elements=finite))
    return ActionLog("joint_angle", rows, starts, end)


@settings(max_examples=25)
@given(log=any_action_logs())
def test_an_action_log_is_read_back_as_it_was_written(log, tmp_path_factory):
    """A log has all executed actions, the calls at which they begin, and the end state.

    Its chunks are the actions of each call.
    """
    folder = tmp_path_factory.mktemp("run")

    digest = write_actions(log, folder)
    read = read_actions(folder, digest)

    assert (read.space, read.digest) == (log.space, digest)
    assert np.array_equal(read.rows, log.rows)
    assert np.array_equal(read.end_state, log.end_state)
    assert np.array_equal(np.concatenate([*read.chunks(), np.empty((0, 8))]), log.rows)
    assert len(log.requests) == 0 or len(read.chunks()) == len(log.requests)


def test_the_digest_of_an_action_log_depends_on_its_content_alone(tmp_path):
    """Not on when or where it is written."""
    digest = write_actions(action_log_of(), tmp_path / "a")

    assert write_actions(action_log_of(), tmp_path / "b") == digest
    assert write_actions(action_log_of(rows=5), tmp_path / "b") != digest


def action_log_of(rows=4):
    """Return a log of one call, after which so many actions were executed."""
    numbers = np.linspace(0.1, 1.7, rows * 8).reshape(rows, 8)
    return ActionLog("joint_angle", numbers, np.array([0], np.int32), np.zeros(3))


def test_actions_that_cannot_be_written_are_reported_in_one_sentence(tmp_path):
    (tmp_path / "actions").touch()
    with pytest.raises(InvalidValueError, match=r"Cannot write .*\.npz: Not a directory\."):
        write_actions(action_log_of(), tmp_path)


def test_a_log_whose_file_was_replaced_by_another_is_refused(tmp_path):
    """A file is named by the digest of its content, and a record by that name refers to it."""
    digest = write_actions(action_log_of(), tmp_path)
    other = write_actions(action_log_of(5), tmp_path)
    action_path(tmp_path, digest).write_bytes(action_path(tmp_path, other).read_bytes())

    with pytest.raises(StoreError, match="does not have the content"):
        read_actions(tmp_path, digest)


@pytest.mark.parametrize("digest", ["", "../../etc/passwd", "A" * 64, "0" * 63, "0" * 64 + "\n"])
def test_a_name_that_is_no_digest_leads_to_no_file(tmp_path, digest):
    with pytest.raises(StoreError, match="not a digest"):
        action_path(tmp_path, digest)


def test_a_missing_action_log_is_reported_with_its_path(tmp_path):
    with pytest.raises(StoreError, match=f"/actions/00/{'0' * 64}.* are missing"):
        read_actions(tmp_path, "0" * 64)


ARRAYS_OF_A_GOOD_LOG = {
    "space": np.array("joint_angle"),
    "rows": np.zeros((4, 8)),
    "requests": np.array([0, 2]),
    "end_state": np.zeros(3),
}
EMPTY_ZIP = b"PK\x05\x06" + bytes(18)


def good_log_except(**changes):
    """Return the content of a good log, but for some arrays."""
    file = io.BytesIO()
    np.savez_compressed(file, **ARRAYS_OF_A_GOOD_LOG | changes)
    return file.getvalue()


@pytest.mark.parametrize(
    "content",
    [
        pytest.param(b"", id="empty"),
        pytest.param(EMPTY_ZIP, id="empty archive"),
        pytest.param(good_log_except(space=np.array("teleport")), id="unknown action space"),
        pytest.param(good_log_except(rows=np.zeros((4, 7))), id="rows of 7 numbers"),
        pytest.param(good_log_except(rows=np.full((4, 8), np.nan)), id="no number"),
        pytest.param(good_log_except(requests=np.array([0, 3, 2])), id="calls out of order"),
        pytest.param(good_log_except(requests=np.array([1, 2])), id="first call not at 0"),
        pytest.param(good_log_except(requests=np.array([0, 9])), id="call after the last row"),
        pytest.param(good_log_except(rows=np.zeros((400_000, 8))), id="too large"),
    ],
)
def test_a_file_that_is_no_valid_action_log_is_refused(tmp_path, content):
    """Each content differs in one point from a good log of four actions of 8 numbers.

    In the good log the policy was called at actions 0 and 2.
    """
    path = action_path(tmp_path, "0" * 64)
    path.parent.mkdir(parents=True)
    path.write_bytes(content)

    with pytest.raises(StoreError, match="is not an action log"):
        read_actions(tmp_path, "0" * 64)


def test_code_pickled_into_an_action_log_is_not_run(tmp_path):
    """The object would make a folder `evil` when it is read."""

    class Evil:
        def __reduce__(self):
            return os.mkdir, (str(tmp_path / "evil"),)

    path = action_path(tmp_path, "0" * 64)
    path.parent.mkdir(parents=True)
    path.write_bytes(good_log_except(requests=np.array([Evil()], dtype=object)))

    with pytest.raises(StoreError, match="is not an action log"):
        read_actions(tmp_path, "0" * 64)
    assert not (tmp_path / "evil").exists()
