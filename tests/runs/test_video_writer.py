import os
import subprocess
import sys

import numpy as np
import pytest
from video_frames import frames_of

from roboirg.records.film import FRAME_STEPS
from roboirg.runs.play.video_writer import (
    GAP,
    VideoWriter,
    compose_frame,
)
from roboirg.util.media import CONTROL_RATE

av = pytest.importorskip("av")


class GreyPictures:
    """Pictures of 256 by 256 pixels: grey 90 of the front camera, grey 200 of the wrist camera."""

    def picture(self, camera):
        return np.full((256, 256, 3), 200 if camera == "wrist" else 90, np.uint8)


def unfinished_video_of_21_frames(folder, point=(40, 200)):
    """Write a video of one frame of a demonstration, and then 20 with a ring at a point."""
    video = VideoWriter(folder / "videos" / "x.mp4")
    video.add_frame(GreyPictures(), True)
    video.point = point
    for _ in range(20):
        video.add_frame(GreyPictures())
    return video


def finished_frames(video):
    """Finish a video and return its frames, an array of frames, rows, columns and colors."""
    video.finish()
    return np.stack(frames_of(video.path)).astype(int)


def test_a_video_appears_only_when_it_is_complete(tmp_path):
    """A video is written elsewhere until it is finished; then the film (mp4) is there, with a
    picture of it (jpg)."""
    video = unfinished_video_of_21_frames(tmp_path)
    assert not video.path.exists()

    assert video.finish()

    assert sorted(path.name for path in video.path.parent.iterdir()) == ["x.jpg", "x.mp4"]


def test_a_video_of_21_like_frames_has_less_than_20_kilobytes(tmp_path):
    """All pictures are grey and equal. Frames that were compressed each on its own, not as changes
    of the one before, would take more."""
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


def test_a_video_shows_the_front_camera_at_the_left_and_the_wrist_camera_at_the_right(tmp_path):
    """The pictures of the front camera are grey 90, those of the wrist camera 200. Each has 256
    columns, so column 128 is in the first and 384 in the second one.

    Compression changes colors a little, here by less than 7 of 256 levels.
    """
    last_frame = finished_frames(unfinished_video_of_21_frames(tmp_path))[-1]

    assert last_frame[128, 128] == pytest.approx([90, 90, 90], abs=7)
    assert last_frame[128, 384] == pytest.approx([200, 200, 200], abs=7)


@pytest.mark.parametrize(("row", "column"), [(1, 100), (-2, 100), (100, 1), (100, -2)])
def test_a_frame_of_the_demonstration_has_a_colored_border(tmp_path, row, column):
    """The first frame of the video is of a demonstration. The border around it is orange: red 255,
    green 176, blue 32. A pixel at each edge is looked at, the second from there.

    Compression changes colors, most of all of thin lines: here by less than 40 of 256 levels.
    """
    first_frame = finished_frames(unfinished_video_of_21_frames(tmp_path))[0]

    assert first_frame[row, column] == pytest.approx([255, 176, 32], abs=40)


def test_a_ring_is_drawn_around_the_place_to_which_the_policy_points(tmp_path):
    """The policy points at row 40 and column 200 of the front picture, which is grey 90. The ring
    has a radius of 6 pixels, so it passes through the pixel 6 rows below. It is yellow: red is 255,
    of which compression leaves about 240, and not 90."""
    last_frame = finished_frames(unfinished_video_of_21_frames(tmp_path, point=(40, 200)))[-1]

    red, _green, _blue = last_frame[40 + 6, 200]
    assert red == pytest.approx(240, abs=49)


def test_a_video_whose_caption_grows_can_be_finished(tmp_path):
    """All frames of a video have one size, so the first one needs room for the longest caption."""
    video = VideoWriter(tmp_path / "x.mp4")
    video.caption = "This one is red."
    video.longest_caption = "This one is red. " * 20
    video.add_frame(GreyPictures(), True)
    video.caption = video.longest_caption
    video.add_frame(GreyPictures())

    assert video.finish(), video.error


def test_a_frame_has_room_for_the_longest_caption_and_ink_for_its_own():
    """A frame has its caption below the pictures, which are 256 pixels high. With a short caption
    it is as high as with the longest one that will come, and higher than for the short one alone.

    Ink is dark pixels: the short caption, a twentieth of the long one, has less than a tenth of its
    ink, but some.
    """
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
    """A program writes the same video twice. With MALLOC_PERTURB_ new memory is filled with a byte,
    here 50 or 200; would find bytes of the file that nothing has set."""
    contents = set()
    for byte in ("50", "200"):
        file = tmp_path / f"{byte}.mp4"
        command = [sys.executable, "-c", PROGRAM_THAT_WRITES_A_VIDEO, str(file)]
        subprocess.run(command, env=os.environ | {"MALLOC_PERTURB_": byte}, check=True)
        contents.add(file.read_bytes())

    assert len(contents) == 1
