from __future__ import annotations

import os
import subprocess
import sys

import numpy as np
import pytest

from roboirg.records.film import FRAME_STEPS
from roboirg.runs.play.video_writer import (
    DEMONSTRATION_COLOR,
    GAP,
    VideoWriter,
    compose_frame,
)
from roboirg.util.media import CONTROL_RATE

av = pytest.importorskip("av")


class Grey:
    def picture(self, camera: str) -> np.ndarray:
        return np.full((256, 256, 3), 200 if camera == "wrist" else 90, np.uint8)


def film_of(folder):
    """Write a video of one frame of a demonstration, and then 20 with a ring at a point."""
    video = VideoWriter(folder / "videos" / "x.mp4")
    video.add_frame(Grey(), True)
    video.point = (40, 200)
    for _ in range(20):
        video.add_frame(Grey())
    return video


def test_a_video_is_small_and_appears_when_complete(tmp_path):
    video = film_of(tmp_path)
    assert not video.path.exists()

    assert video.finish()
    assert sorted(path.name for path in video.path.parent.iterdir()) == ["x.jpg", "x.mp4"]
    assert video.path.stat().st_size < 20_000


def test_a_video_is_playable_and_shows_demonstration_and_point(tmp_path):
    video = film_of(tmp_path)
    video.finish()

    with av.open(str(video.path)) as container:
        stream = container.streams.video[0]
        assert stream.codec_context.name == "h264"
        assert stream.codec_context.pix_fmt == "yuv420p"
        assert (stream.width, stream.height, stream.average_rate) == (512 + GAP, 256, 10)
        assert stream.average_rate * FRAME_STEPS == 4 * CONTROL_RATE  # fourfold speed
        frames = [frame.to_ndarray(format="rgb24") for frame in container.decode(stream)]
    assert len(frames) == 21 + 8  # the page counts on it

    edges = frames[0][[1, -2, 100, 100], [100, 100, 1, -2]].astype(int)
    assert np.abs(edges - DEMONSTRATION_COLOR).max() < 40

    # Front, wrist, and the ring: 6 rows below its point in the front picture.
    front, wrist, ring = frames[-1][[128, 128, 46], [128, 384, 200], 0].astype(int)
    assert front == pytest.approx(90, abs=7)
    assert wrist == pytest.approx(200, abs=7)
    assert ring == pytest.approx(240, abs=49)


def test_a_caption_that_grows_has_room_for_all_of_it(tmp_path):
    video = VideoWriter(tmp_path / "x.mp4")
    first = "This one is red."
    longest = "This one is red. " * 20
    video.caption = first
    video.longest_caption = longest
    video.add_frame(Grey(), True)
    video.caption = longest
    video.add_frame(Grey())

    assert video.finish(), video.error

    pictures = [Grey().picture("front"), Grey().picture("wrist")]
    short, long = (
        compose_frame(pictures, caption, longest_caption=longest) for caption in (first, longest)
    )
    assert short.shape == long.shape == compose_frame(pictures, longest).shape
    assert len(compose_frame(pictures, first)) < len(short)

    dark = [int((frame[256:] < 128).sum()) for frame in (short, long)]
    assert 0 < dark[0] < dark[1] / 10


ENCODE = """
import sys
from pathlib import Path
import numpy as np
from roboirg.runs.play.video_writer import VideoWriter
tiles = np.random.default_rng(0).integers(0, 255, (39, 65, 3), dtype=np.uint8)
picture = tiles.repeat(8, 0).repeat(8, 1)[:310, :516]
class Source:
    shift = 0
    def picture(self, camera):
        self.shift += 1
        return np.roll(picture, self.shift, 1)[:, :256] if camera == "front" else picture[:, 260:]
writer, source = VideoWriter(Path(sys.argv[1])), Source()
for _ in range(30):
    writer.add_frame(source)
assert writer.finish(), writer.error
"""


def test_equal_pictures_give_equal_files_whatever_was_in_memory(tmp_path):
    files = [tmp_path / f"{byte}.mp4" for byte in (50, 200)]
    for file in files:
        environment = os.environ | {"MALLOC_PERTURB_": file.stem}
        command = [sys.executable, "-c", ENCODE, str(file)]
        subprocess.run(command, env=environment, check=True)
    assert len({file.read_bytes() for file in files}) == 1
