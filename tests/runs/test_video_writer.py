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


def test_a_video_appears_only_when_it_is_complete(tmp_path):
    """A video is written elsewhere until it is finished; then it is there, with a picture."""
    video = unfinished_video_of_21_frames(tmp_path)
    assert not video.path.exists()

    assert video.finish()
    assert sorted(path.name for path in video.path.parent.iterdir()) == ["x.jpg", "x.mp4"]


def test_a_video_of_21_like_frames_has_less_than_20_kilobytes(tmp_path):
    """Frames without compression in time would take more."""
    video = unfinished_video_of_21_frames(tmp_path)
    video.finish()

    assert video.path.stat().st_size < 20_000


def test_a_video_is_h264_of_ten_frames_a_second_at_fourfold_speed(tmp_path):
    """A frame is drawn every `FRAME_STEPS` steps, ten frames a second: four times real time.

    Two pictures of 256 pixels stand side by side with a gap. The last of 21 frames is repeated for
    0.8 s (8 frames), on which the page counts.
    """
    video = unfinished_video_of_21_frames(tmp_path)
    video.finish()

    with av.open(str(video.path)) as container:
        stream = container.streams.video[0]
        assert (stream.codec_context.name, stream.codec_context.pix_fmt) == ("h264", "yuv420p")
        assert (stream.width, stream.height, stream.average_rate) == (512 + GAP, 256, 10)
        assert stream.average_rate * FRAME_STEPS == 4 * CONTROL_RATE
        assert len(list(container.decode(stream))) == 21 + 8


def test_a_video_shows_both_cameras_a_frame_around_the_demonstration_and_the_pointed_place(
    tmp_path,
):
    """The front camera is grey 90 at the left, the wrist camera 200 at the right.

    Only the first frame is of a demonstration: each of its four edges, of the left picture and the
    whole, has the color for it. In the last frame a ring is drawn around the point (row 40, column
    200). The margins allow for the losses of the compression.
    """
    video = unfinished_video_of_21_frames(tmp_path)
    video.finish()

    with av.open(str(video.path)) as container:
        frames = [frame.to_ndarray(format="rgb24") for frame in container.decode(video=0)]

    demonstration = frames[0].astype(int)
    for row, column in ((1, 100), (-2, 100), (100, 1), (100, -2)):
        assert np.abs(demonstration[row, column] - DEMONSTRATION_COLOR).max() < 40
    red = frames[-1][..., 0]
    assert red[128, 128] == pytest.approx(90, abs=7), "front"
    assert red[128, 384] == pytest.approx(200, abs=7), "wrist"
    assert red[46, 200] == pytest.approx(240, abs=49), "ring, 6 rows below its point"


def test_a_video_whose_caption_grows_can_be_finished(tmp_path):
    """All frames of a video have one size."""
    video = VideoWriter(tmp_path / "x.mp4")
    video.caption = "This one is red."
    video.longest_caption = "This one is red. " * 20
    video.add_frame(GreyPictures(), True)
    video.caption = video.longest_caption
    video.add_frame(GreyPictures())

    assert video.finish(), video.error


def test_a_frame_has_room_for_the_longest_caption_and_ink_for_its_own():
    """Ink is dark pixels below the pictures, which are 256 pixels high."""
    pictures = [np.full((256, 256, 3), 200, np.uint8)] * 2
    short = "This one is red."
    long = short * 20

    with_short = compose_frame(pictures, short, longest_caption=long)
    with_long = compose_frame(pictures, long, longest_caption=long)

    assert with_short.shape == with_long.shape == compose_frame(pictures, long).shape
    assert len(compose_frame(pictures, short)) < len(with_short)
    assert 0 < (with_short[256:] < 128).sum() < (with_long[256:] < 128).sum() / 10


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
    contents = set()
    for byte in ("50", "200"):
        file = tmp_path / f"{byte}.mp4"
        command = [sys.executable, "-c", PROGRAM_THAT_WRITES_A_VIDEO, str(file)]
        subprocess.run(command, env=os.environ | {"MALLOC_PERTURB_": byte}, check=True)
        contents.add(file.read_bytes())

    assert len(contents) == 1
