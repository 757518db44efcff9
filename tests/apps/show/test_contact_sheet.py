"""Contact sheets, the choice of moments, and an episode in words."""

import cv2
import numpy as np
import pytest

from roboirg.apps.show.contact_sheet import SheetPanel, compose_sheet, evenly_spaced, write_png
from roboirg.apps.show.episode_text import describe_motions, describe_video, fact_words
from roboirg.apps.show.playthrough import (
    MAX_MOMENTS,
    MIN_MOMENTS,
    KeyEvents,
    choose_moments,
    play_through,
)
from roboirg.core.conditions import Fact
from roboirg.core.episode import Scene
from roboirg.core.errors import InvalidValueError
from roboirg.core.motions import Away, Glow, Point, Shuttle, Swap, Vanish
from roboirg.tasks.splits.splits import get_episode


def picture(value):
    return np.full((256, 256, 3), value, np.uint8)


def moments(count, caption="done"):
    return [
        SheetPanel(number, caption, (picture(10 + number), picture(100 + number)), number == 0)
        for number in range(count)
    ]


@pytest.mark.parametrize("count", [1, 4, 6, 8, 12])
def test_every_picture_is_there_once_and_whole(count):
    sheet = compose_sheet("Title", "What is said. " * 40, moments(count))
    for number in range(count):
        for value in (10 + number, 100 + number):
            found = (sheet == value).all(axis=-1).sum()
            assert found >= 256 * 256
            assert found < 256 * 256 * 1.01  # but for the grey edges of letters


def test_moments_go_from_left_to_right_and_cameras_from_top_to_bottom():
    sheet = compose_sheet("", "", moments(8, caption=""))
    corners = [np.argwhere((sheet == 10 + number).all(axis=-1))[0] for number in range(8)]
    wrists = [np.argwhere((sheet == 100 + number).all(axis=-1))[0] for number in range(8)]
    assert len({y for y, _ in corners[:4]}) == 1  # eight are four and four
    assert corners[4][0] > wrists[0][0] > corners[0][0]
    assert [x for _, x in corners[:4]] == sorted({x for _, x in corners[:4]})
    assert corners[4][1] == corners[0][1]


def test_captions_are_drawn_and_long_ones_stay_in_their_column():
    short = compose_sheet("T", "s", moments(2, caption="pick"))
    assert short.shape[0] < compose_sheet("T", "s", moments(2, caption="pick " * 30)).shape[0]
    many = compose_sheet("T", "s", moments(2, caption="pick " * 900))
    assert many.shape[0] < short.shape[0] + 200
    assert (compose_sheet("Other", "s", moments(2)) != compose_sheet("T", "s", moments(2))).any()
    compose_sheet("—", "naïve", moments(1, caption="×" * 400))  # no letters of the font


def test_moments_of_the_video_have_another_color():
    one = SheetPanel(3, "", (picture(0),))
    assert (compose_sheet("", "", [one]) == (9, 105, 218)).all(axis=-1).any()
    assert not (compose_sheet("", "", [one]) == (255, 176, 32)).all(axis=-1).any()
    assert (compose_sheet("", "", moments(1)) == (255, 176, 32)).all(axis=-1).any()


def test_pictures_are_written_in_their_colors(tmp_path):
    image = np.zeros((4, 5, 3), np.uint8)
    image[..., 0] = 200
    write_png(image, tmp_path / "new" / "sheet.png")
    read = cv2.imread(str(tmp_path / "new" / "sheet.png"))
    assert (read[..., 2] == 200).all()
    assert not read[..., :2].any()
    with pytest.raises(InvalidValueError, match="cannot be written"):
        write_png(image, tmp_path)


def test_thinning_keeps_the_ends():
    assert evenly_spaced(3, 5) == (0, 1, 2)
    assert evenly_spaced(10, 4) == (0, 3, 6, 9)
    assert evenly_spaced(10, 1) == (9,)
    assert evenly_spaced(10, 0) == ()
    for count in range(30):
        for most in range(15):
            kept = evenly_spaced(count, most)
            assert len(set(kept)) == len(kept) == min(count, most)


def test_the_remarkable_is_chosen_first_and_fillers_only_fill_up():
    assert choose_moments([0, 4, 4, 4, 0]) == (0, 1, 2, 3, 4)
    filled = choose_moments([0, *[4] * 20, 1, 0])
    assert len(filled) == MIN_MOMENTS
    assert {0, 21, 22} <= set(filled)
    assert choose_moments([0, 1, 4, 1, 4, 1, 1, 0]) == (0, 1, 3, 5, 6, 7)
    crowded = [0, *[3] * 20, 0, *[1] * 8, 0]
    chosen = choose_moments(crowded)
    assert len(chosen) == MAX_MOMENTS
    assert [crowded[position] for position in chosen].count(3) == 1
    assert len(choose_moments([1] * 40)) == MAX_MOMENTS


def test_motions_are_described_and_like_ones_merged():
    over = Fact("over", "cube", "target")
    motions = (
        Away("a", 0, 32),
        Away("b", 0, 32),
        Away("c", 64, 164, under="a"),
        Swap("a", "b", 0, 50, 0.07, stage=3),
        Shuttle("s", Point(0, -0.3, 0), Point(0, 0.3, 0), 60, 5, Fact("pressed", "button")),
        Glow("m", over, 20),
        Vanish("cube", Fact("binned", "cube", "bin")),
    )
    assert describe_motions(Scene((), motions)) == [
        "a, b: away until step 32",
        "c: away from step 64 until step 164, then under a",
        "a and b: change places, step 0 to 50 of the video's stage 4",
        (
            "s: runs from (0.00, -0.30) to (0.00, 0.30) and back, "
            "5 passes of 60 steps, until button pressed"
        ),
        "m: seen while cube over target, and 20 steps longer",
        "cube: gone for good once in bin",
    ]
    assert fact_words(Fact("still", "robot")) == "robot still"


def test_the_video_is_described_by_its_stages_and_facts():
    lines = describe_video(get_episode("VideoPlaceButton", "test", 0))
    assert lines[:2] == ["1. pick up the cube", "2. drop the cube onto target"]
    assert "go home" not in " ".join(lines)  # it is not in the video
    assert lines[-1].startswith("that is: cube_")
    assert lines[-1].count("button pressed") == 1
    assert describe_video(get_episode("PickXtimes", "test", 0)) == []


@pytest.mark.sim
def test_a_playthrough_shows_the_start_each_stage_and_the_end():
    episode = get_episode("VideoUnmask", "test", 0)
    played = play_through(episode)
    assert played.verdict == "success"
    steps = [moment.step for moment in played.moments]
    assert steps == sorted(set(steps))
    assert len(steps) == MIN_MOMENTS
    assert played.moments[0].caption == "the video begins"
    assert played.moments[0].is_demonstration
    (turn,) = [one for one in played.moments if one.caption == "the policy's turn begins"]
    assert not turn.is_demonstration
    assert played.moments[-1].caption.startswith("success: pick up the container")
    assert played.moments[-1].step == played.steps
    assert all(one.pictures[0].shape == (256, 256, 3) for one in played.moments)
    assert len({one.pictures[0].tobytes() for one in played.moments}) > 2


def test_what_moves_by_itself_is_remarkable_while_it_does():
    episode = get_episode("ButtonUnmaskSwap", "test", 3)
    key_events = KeyEvents(episode.scene.motions)
    captions = {step: key_events.at(step, 0) for step in range(300)}
    assert str(captions[33]).endswith("container 3 appear")
    swaps = [step for step, words in captions.items() if words and "change places" in words]
    count = sum(isinstance(motion, Swap) for motion in episode.scene.motions)
    assert swaps == [90, 140, 190][:count]

    late = KeyEvents([Swap("a", "b", 50, 50, 0.1, stage=2)])
    assert [step for step in range(200) if late.at(step, 2 if step >= 80 else 0)] == [156]
