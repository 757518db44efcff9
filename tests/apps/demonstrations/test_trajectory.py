"""Files of trajectories, and the coding of their pictures."""

import io
import zipfile

import numpy as np
import pytest
import synthetic_trajectories as synthetic
from video_frames import frames_of

from roboirg.apps.demonstrations.picture_coding import VideoEncoder
from roboirg.apps.demonstrations.trajectory import (
    drop_pictures,
    has_pictures,
    load_facts,
    load_trajectory,
    read_depth,
    read_picture,
)
from roboirg.apps.demonstrations.trajectory_recorder import RecordingSpec
from roboirg.core.errors import InvalidValueError
from roboirg.core.observations import PICTURE_SIZE
from roboirg.tasks.splits.splits import get_episode


@pytest.fixture
def trajectory(tmp_path):
    """The file of an episode with four rows of video and depth, and its facts."""
    path = tmp_path / "one.zip"
    episode = get_episode("VideoUnmask", "train", 0)
    return path, synthetic.record(episode, None, path, RecordingSpec(video=True, depth=True))


def test_facts_of_a_trajectory_are_read_as_they_were_written(trajectory):
    """The file has four rows of video, and then the policy's steps."""
    path, facts = trajectory

    assert load_trajectory(path).facts == load_facts(path) == facts
    assert (facts.video_length, facts.frames) == (4, 4 + synthetic.STEPS)


def test_pictures_and_depth_of_a_trajectory_are_read_as_they_were_written(trajectory):
    """There is a picture at reset and one after each step, hence one more than frames.

    Synthetic pictures and depth follow from the camera, the seed and the row.
    """
    path, facts = trajectory

    with zipfile.ZipFile(path) as archive:
        for row in range(facts.frames + 1):
            picture = read_picture(archive, "wrist", row)
            depth = read_depth(archive, "wrist", row)
            assert np.array_equal(picture, synthetic.picture("wrist", facts.seed, row))
            assert np.array_equal(depth, synthetic.depth(facts.seed, row))


def test_a_trajectory_with_depth_has_the_calibration_of_both_cameras(trajectory):
    path, _ = trajectory
    assert set(load_trajectory(path).calibration) == {
        "front_extrinsic", "front_intrinsic", "wrist_extrinsic", "wrist_intrinsic",
    }  # fmt: skip


def test_pictures_can_be_dropped_and_nothing_else(trajectory):
    """Facts and actions stay as they were; to drop pictures twice does no harm."""
    path, facts = trajectory
    actions = load_trajectory(path).actions
    assert has_pictures(path)

    drop_pictures(path)
    drop_pictures(path)

    assert not has_pictures(path)
    after = load_trajectory(path)
    assert after.facts == facts
    assert np.array_equal(after.actions, actions)


def test_a_damaged_trajectory_is_refused_by_its_name(tmp_path):
    path = tmp_path / "one.zip"
    path.write_bytes(b"no archive")

    with pytest.raises(InvalidValueError, match=r"one\.zip' cannot be read"):
        load_trajectory(path)


@pytest.mark.parametrize(
    ("coding", "largest_mean_difference"), [("lossless-video", 0.0), ("lossy-video", 4.0)]
)
def test_a_video_shows_what_was_encoded(coding, largest_mean_difference):
    """Differences are of pixel values from 0 to 255: none without loss, at most 4 on average
    with.
    """
    pictures = np.stack([synthetic.picture("front", 7, row) for row in range(25)])
    encoder = VideoEncoder(coding, PICTURE_SIZE)
    for picture in pictures:
        encoder.add(picture)

    shown = np.stack(frames_of(io.BytesIO(encoder.finish())))

    assert np.abs(shown.astype(int) - pictures).mean() <= largest_mean_difference
