"""Strips of pictures, the choice of moments, and an episode in words."""

import numpy as np
import pytest

from roboirg.analysis.figures.figure_style import DARK_STYLE, STYLE
from roboirg.apps.show.episode_strip import SpokenSetting, StripMoment, draw_strip
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
from roboirg.core.motions import Away, Glow, Point, Shuttle, Swap, Vanish
from roboirg.core.observations import PICTURE_SIZE
from roboirg.tasks.splits.splits import get_episode

pytest.importorskip("matplotlib")

import matplotlib as mpl
from matplotlib.backends.backend_agg import FigureCanvasAgg

SAID = [
    SpokenSetting("explicit", "Lift it.", "#000000"),
    SpokenSetting("direct", "I like it. " * 30, "#0072B2"),
]


def moments(count, caption="done"):
    return [
        StripMoment(
            10 * number, caption, np.full((256, 256, 3), 10 + number, np.uint8), number == 0
        )
        for number in range(count)
    ]


def drawn(count, caption="done", style=STYLE):
    with mpl.rc_context(style):
        figure = draw_strip("A title", SAID, moments(count, caption))
        FigureCanvasAgg(figure).draw()
    return figure


def test_every_picture_is_there_once_and_in_order_of_time_in_rows_of_four():
    figure = drawn(8)
    values = [axes.images[0].get_array()[0, 0, 0] for axes in figure.axes]
    assert values == list(range(10, 18))

    places = [axes.get_position() for axes in figure.axes]
    assert places == sorted(places, key=lambda place: (-round(place.y0, 6), place.x0))
    assert [round(place.y0, 6) for place in places].count(round(places[0].y0, 6)) == 4


@pytest.mark.parametrize("caption", ["done: pick", "done: pick up the container " * 30])
def test_no_word_leaves_the_strip_and_none_is_drawn_over_another(caption):
    figure = drawn(12, caption)
    boxes = [text.get_window_extent() for text in figure.texts]
    for number, box in enumerate(boxes):
        assert box.x0 >= 0
        assert box.x1 <= figure.bbox.x1
        assert box.y0 >= 0
        assert not [other for other in boxes[:number] if other.padded(-2).overlaps(box.padded(-2))]


def test_what_is_said_is_above_the_pictures_in_its_setting_s_color():
    found = {text.get_text(): text for text in drawn(3).texts}
    assert {"A title", "explicit", "Lift it.", "direct", "0.0 s, video", "0.5 s"} <= set(found)

    colors = [found[text].get_color() for text in ("direct", "0.0 s, video", "0.5 s")]
    assert colors == ["#0072B2", "#E69F00", "#8a8a8a"]

    sides = [text.get_text() for text in drawn(3).axes[0].texts]
    assert sides == ["robot's right", "robot's left"]  # the front camera faces the robot

    on_dark = {text.get_text(): text for text in drawn(3, style=DARK_STYLE).texts}
    assert on_dark["explicit"].get_color() == DARK_STYLE["text.color"]  # black would not be seen


def test_the_remarkable_is_chosen_first_and_fillers_only_fill_up():
    assert choose_moments([0, 4, 4, 4, 0]) == (0, 1, 2, 3, 4)

    filled = choose_moments([0, *[4] * 20, 1, 0])
    assert len(filled) == MIN_MOMENTS
    assert {0, 21, 22} <= set(filled)
    assert choose_moments([0, 1, 4, 1, 4, 1, 1, 0]) == (0, 1, 3, 5, 6, 7)
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
def test_a_playthrough_shows_the_start_each_stage_and_the_end(snapshot):
    played = play_through(get_episode("VideoUnmask", "test", 3))
    assert (played.verdict, played.moments[-1].step) == ("success", played.steps)
    assert [
        (moment.step, moment.caption, moment.is_demonstration) for moment in played.moments
    ] == snapshot
    for moment in played.moments:
        assert moment.picture.shape == (PICTURE_SIZE, PICTURE_SIZE, 3)
    assert len({moment.picture.tobytes() for moment in played.moments}) > 2


def test_what_moves_by_itself_is_remarkable_while_it_does():
    episode = get_episode("ButtonUnmaskSwap", "test", 3)
    key_events = KeyEvents(episode.scene.motions)

    captions = [str(key_events.at(step, 0)) for step in range(300)]

    assert captions[33].endswith("container 3 appear")
    swaps = [step for step, caption in enumerate(captions) if "change places" in caption]
    count = sum(isinstance(motion, Swap) for motion in episode.scene.motions)
    assert swaps == [90, 140, 190][:count]


def test_motions_of_a_stage_are_remarkable_from_then_on():
    key_events = KeyEvents([Swap("a", "b", 50, 50, 0.1, stage=2), Away("c", 10, 60, under="a")])

    before = [step for step in range(80) if key_events.at(step, 0)]
    after = [step for step in range(80, 200) if key_events.at(step, 2)]

    assert (before, after) == ([], [156])
