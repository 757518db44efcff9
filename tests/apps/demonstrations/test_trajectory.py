"""Files of trajectories, and the coding of their pictures."""

import io
import zipfile

import av
import numpy as np
import pytest
import synthetic_trajectories as synthetic

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


def frames_of(content):
    with av.open(io.BytesIO(content)) as container:
        return [frame.to_ndarray(format="rgb24") for frame in container.decode(video=0)]


def test_a_trajectory_is_read_as_it_was_written(tmp_path):
    episode = get_episode("VideoUnmask", "train", 0)
    path = tmp_path / "one.zip"
    facts = synthetic.record(episode, None, path, RecordingSpec(video=True, depth=True))
    found = load_trajectory(path)

    assert found.facts == load_facts(path) == facts
    assert (facts.video_length, facts.frames) == (4, 4 + synthetic.STEPS)
    assert set(found.calibration) == {
        f"{camera}_{kind}" for camera in ("front", "wrist") for kind in ("extrinsic", "intrinsic")
    }

    with zipfile.ZipFile(path) as archive:
        for row in range(facts.frames + 1):
            picture = read_picture(archive, "wrist", row)
            depth = read_depth(archive, "wrist", row)
            assert np.array_equal(picture, synthetic.picture("wrist", episode.seed, row))
            assert np.array_equal(depth, synthetic.depth(episode.seed, row))


def test_pictures_can_be_dropped_and_nothing_else(tmp_path):
    path = tmp_path / "one.zip"
    synthetic.record(get_episode("PickXtimes", "train", 0), None, path, RecordingSpec())
    before = load_trajectory(path)
    assert has_pictures(path)
    for _ in range(2):
        drop_pictures(path)
        assert not has_pictures(path)

    after = load_trajectory(path)
    assert after.facts == before.facts
    assert np.array_equal(after.actions, before.actions)


def test_a_damaged_trajectory_is_named(tmp_path):
    path = tmp_path / "one.zip"
    path.write_bytes(b"no archive")
    with pytest.raises(InvalidValueError, match=r"one\.zip' cannot be read"):
        load_trajectory(path)


@pytest.mark.parametrize(("coding", "most"), [("lossless-video", 0.0), ("lossy-video", 4.0)])
def test_a_video_shows_what_was_encoded(coding, most):
    encoder = VideoEncoder(coding, PICTURE_SIZE)
    pictures = np.stack([synthetic.picture("front", 7, row) for row in range(25)])
    for picture in pictures:
        encoder.add(picture)

    found = np.stack(frames_of(encoder.finish()))

    assert np.abs(found.astype(int) - pictures).mean() <= most
