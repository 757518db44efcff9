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


class GreyPictures:
    def picture(self, camera):
        return np.full((256, 256, 3), 200 if camera == "wrist" else 90, np.uint8)


def unfinished_video_of_21_frames(folder):
    """Write a video of one frame of a demonstration, and then 20 with a ring at a point."""
    video = VideoWriter(folder / "videos" / "x.mp4")
    video.add_frame(GreyPictures(), True)
    video.point = (40, 200)
    for _ in range(20):
        video.add_frame(GreyPictures())
    return video


def test_a_video_appears_only_when_it_is_complete_and_is_small(tmp_path):
    """21 frames; the limit of 20 kB would be broken by frames without compression in time."""
    video = unfinished_video_of_21_frames(tmp_path)
    assert not video.path.exists()

    assert video.finish()
    assert sorted(path.name for path in video.path.parent.iterdir()) == ["x.jpg", "x.mp4"]
    assert video.path.stat().st_size < 20_000


def test_a_video_shows_both_cameras_a_frame_around_the_demonstration_and_the_pointed_place(
    tmp_path,
):
    """Front at the left, wrist at the right; a ring around the point (40, 200) of the front."""
    video = unfinished_video_of_21_frames(tmp_path)
    video.finish()

    with av.open(str(video.path)) as container:
        stream = container.streams.video[0]
        assert stream.codec_context.name == "h264"
        assert stream.codec_context.pix_fmt == "yuv420p"
        assert (stream.width, stream.height, stream.average_rate) == (512 + GAP, 256, 10)
        assert stream.average_rate * FRAME_STEPS == 4 * CONTROL_RATE  # fourfold speed
        frames = [frame.to_ndarray(format="rgb24") for frame in container.decode(stream)]
    assert len(frames) == 21 + 8  # the last is repeated for 0.8 s; the page counts on it

    edges = frames[0][[1, -2, 100, 100], [100, 100, 1, -2]].astype(int)
    assert np.abs(edges - DEMONSTRATION_COLOR).max() < 40

    # Front, wrist, and the ring: 6 rows below its point in the front picture.
    front, wrist, ring = frames[-1][[128, 128, 46], [128, 384, 200], 0].astype(int)
    assert front == pytest.approx(90, abs=7)
    assert wrist == pytest.approx(200, abs=7)
    assert ring == pytest.approx(240, abs=49)


def test_frames_have_one_height_although_the_caption_grows(tmp_path):
    """With room for the longest caption from the first frame; a short one has less dark ink."""
    video = VideoWriter(tmp_path / "x.mp4")
    first = "This one is red."
    longest = "This one is red. " * 20
    video.caption = first
    video.longest_caption = longest
    video.add_frame(GreyPictures(), True)
    video.caption = longest
    video.add_frame(GreyPictures())

    assert video.finish(), video.error

    pictures = [GreyPictures().picture("front"), GreyPictures().picture("wrist")]
    short, long = (
        compose_frame(pictures, caption, longest_caption=longest) for caption in (first, longest)
    )
    assert short.shape == long.shape == compose_frame(pictures, longest).shape
    assert len(compose_frame(pictures, first)) < len(short)

    dark = [int((frame[256:] < 128).sum()) for frame in (short, long)]
    assert 0 < dark[0] < dark[1] / 10


PROGRAM_THAT_WRITES_A_VIDEO = """
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
    """MALLOC_PERTURB_ fills new memory with a byte; would find bytes that nothing has set."""
    files = [tmp_path / f"{byte}.mp4" for byte in (50, 200)]
    for file in files:
        environment = os.environ | {"MALLOC_PERTURB_": file.stem}
        command = [sys.executable, "-c", PROGRAM_THAT_WRITES_A_VIDEO, str(file)]
        subprocess.run(command, env=environment, check=True)
    assert len({file.read_bytes() for file in files}) == 1
