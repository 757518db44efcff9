"""Strips of pictures, the choice of moments, and an episode in words."""

import itertools

import numpy as np
import pytest

from roboirg.analysis.figures.figure_style import style
from roboirg.analysis.palette import palette
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
from roboirg.tasks.splits.splits import get_episode

pytest.importorskip("matplotlib")

import matplotlib as mpl
from matplotlib.backends.backend_agg import FigureCanvasAgg

SAID = [
    SpokenSetting("explicit", "Lift it.", "#000000"),
    SpokenSetting("direct", "I like it. " * 30, "#0072B2"),
]


def moments(count, caption="done"):
    """Return so many moments, 10 steps apart, of which the first is in the video.

    The picture of number n has the value 10 + n everywhere.
    """
    found = []
    for number in range(count):
        picture = np.full((256, 256, 3), 10 + number, np.uint8)
        found.append(StripMoment(10 * number, caption, picture, is_demonstration=number == 0))
    return found


LIGHT = palette().light


def drawn(count, caption="done", colors=LIGHT):
    """Draw a strip of so many moments with two instructions, and return the figure."""
    with mpl.rc_context(style(colors)):
        figure = draw_strip("A title", SAID, moments(count, caption))
        FigureCanvasAgg(figure).draw()
    return figure


def test_every_picture_is_there_once_and_in_order_of_time():
    """`moments` makes pictures of the value 10 + their number; eight of them are drawn."""
    pictures = [axes.images[0].get_array() for axes in drawn(8).axes]
    assert [picture[0, 0, 0] for picture in pictures] == [10, 11, 12, 13, 14, 15, 16, 17]


def test_pictures_are_in_rows_of_four_from_top_to_bottom_and_left_to_right():
    """Eight pictures: each row has one height, the first row is higher, both begin at the left."""
    places = [axes.get_position() for axes in drawn(8).axes]

    heights = [round(place.y0, 6) for place in places]
    lefts = [place.x0 for place in places]
    assert heights[:4] == [heights[0]] * 4
    assert heights[4:] == [heights[4]] * 4
    assert heights[0] > heights[4]
    assert lefts[:4] == sorted(lefts[:4]) == lefts[4:]


@pytest.mark.parametrize("caption", ["done: pick", "done: pick up the container " * 30])
def test_no_word_leaves_the_strip(caption):
    """A short caption and one of 30 lines' words, under each of twelve pictures, stay on the
    figure.
    """
    figure = drawn(12, caption)

    for text in figure.texts:
        box = text.get_window_extent()
        assert 0 <= box.x0 < box.x1 <= figure.bbox.x1, text
        assert box.y0 >= 0, text


@pytest.mark.parametrize("caption", ["done: pick", "done: pick up the container " * 30])
def test_no_word_is_drawn_over_another(caption):
    """The boxes around all texts of a strip are compared two by two. Boxes may touch by two pixels,
    as letters do not fill them.
    """
    boxes = [text.get_window_extent().padded(-2) for text in drawn(12, caption).texts]

    for first, second in itertools.combinations(boxes, 2):
        assert not first.overlaps(second)


@pytest.mark.parametrize(
    ("text", "color"),
    [("direct", "#0072B2"), ("0.0 s, video", "#2b5c8a"), ("0.5 s", "#8d877b")],
    ids=["setting", "time in the video", "time of the policy"],
)
def test_a_strip_names_settings_and_times_in_their_colors(text, color):
    """Three moments are at steps 0 (in the video), 10 and 20; with 20 steps a second, 10 is
    0.5 s.
    """
    texts = {found.get_text(): found for found in drawn(3).texts}
    assert texts[text].get_color() == color


def test_a_strip_has_a_title_and_the_instructions():
    texts = {found.get_text() for found in drawn(3).texts}
    assert {"A title", "explicit", "Lift it."} <= texts


def test_the_first_picture_says_where_the_robots_left_is():
    """The front camera faces the robot."""
    first, *_ = drawn(3).axes
    assert [text.get_text() for text in first.texts] == ["robot's right", "robot's left"]


def test_black_text_is_drawn_in_another_color_on_dark():
    """The setting *explicit* is black, which would not be seen."""
    texts = {found.get_text(): found for found in drawn(3, colors=palette().dark).texts}
    assert texts["explicit"].get_color() == palette().dark["ink"]


@pytest.mark.parametrize(
    ("remarkable", "chosen"),
    [
        pytest.param([0, 4, 4, 4, 0], (0, 1, 2, 3, 4), id="all of a few"),
        pytest.param([0, 1, 4, 1, 4, 1, 1, 0], (0, 1, 3, 5, 6, 7), id="the remarkable first"),
    ],
)
def test_the_remarkable_is_chosen_first(remarkable, chosen):
    """Smaller numbers are more remarkable: 0 is the start or the end, 4 a filler.

    The answer has the places of the chosen moments, six at least; of eight, a filler is left out
    before a moment of 1.
    """
    assert choose_moments(remarkable) == chosen


def test_fillers_only_fill_up_to_the_smallest_number_of_moments():
    """Of 23 moments the start, one of 1 and the end are remarkable (places 0, 21, 22).

    The other 20 are fillers, of which only as many are taken as `MIN_MOMENTS` needs.
    """
    chosen = choose_moments([0, *[4] * 20, 1, 0])

    assert len(chosen) == MIN_MOMENTS
    assert {0, 21, 22} <= set(chosen)


def test_of_very_many_remarkable_moments_some_are_left_out():
    """Forty moments that are equally remarkable are more than a strip holds."""
    assert len(choose_moments([1] * 40)) == MAX_MOMENTS


@pytest.mark.parametrize(
    ("motions", "sentence"),
    [
        ((Away("a", 0, 32), Away("b", 0, 32)), "a, b: away until step 32"),
        (
            (Away("c", 64, 164, under="a"),),
            "c: away from step 64 until step 164, then under a",
        ),
        (
            (Swap("a", "b", 0, 50, 0.07, stage=3),),
            "a and b: change places, step 0 to 50 of the video's stage 4",
        ),
        (
            (Shuttle("s", Point(0, -0.3, 0), Point(0, 0.3, 0), 60, 5, Fact("pressed", "button")),),
            (
                "s: runs from (0.00, -0.30) to (0.00, 0.30) and back, "
                "5 passes of 60 steps, until button pressed"
            ),
        ),
        (
            (Glow("m", Fact("over", "cube", "target"), 20),),
            "m: seen while cube over target, and 20 steps longer",
        ),
        ((Vanish("cube", Fact("binned", "cube", "bin")),), "cube: gone for good once in bin"),
    ],
    ids=["like ones", "away", "swap", "shuttle", "glow", "vanish"],
)
def test_motions_are_described_in_words(motions, sentence):
    """Each tuple of motions of a scene gives one sentence; stages count from 0, in words from 1."""
    assert describe_motions(Scene((), motions)) == [sentence]


def test_a_fact_without_a_place_is_described_in_two_words():
    assert fact_words(Fact("still", "robot")) == "robot still"


def test_the_video_is_described_by_its_stages_and_facts():
    """In test episode 0 of VideoPlaceButton the video shows a cube that is dropped onto a target,
    and then a press of the button. The arm going home is no part of the video.
    """
    lines = describe_video(get_episode("VideoPlaceButton", "test", 0))

    assert lines[:2] == ["1. pick up the cube", "2. drop the cube onto target"]
    assert "go home" not in " ".join(lines)
    assert lines[-1].startswith("that is: cube_")
    assert lines[-1].count("button pressed") == 1


def test_an_episode_without_a_video_has_no_description_of_one():
    assert describe_video(get_episode("PickXtimes", "test", 0)) == []


@pytest.mark.sim
def test_a_playthrough_shows_the_start_each_stage_and_the_end():
    """The expert solves test episode 3 of VideoUnmask: cubes are hidden in the video, and then it
    picks up the containers over the green one and the red one. The last moment is its last step,
    and the pictures differ, as things move in between.
    """
    played = play_through(get_episode("VideoUnmask", "test", 3))

    captions = [f"{moment.step}: {moment.caption}" for moment in played.moments]
    assert captions == [
        "1: the video begins",
        "33: container 0, container 1, container 2, container 3, container 4 appear",
        "64: done: static",
        "67: the policy's turn begins",
        "167: done: pick up the container that hides the green cube",
        "207: done: put down the container",
        "328: success: pick up the container that hides the red cube",
    ]
    assert [moment.is_demonstration for moment in played.moments] == [True] * 3 + [False] * 4
    assert (played.verdict, played.steps) == ("success", 328)
    assert {moment.picture.shape for moment in played.moments} == {(256, 256, 3)}
    assert len({moment.picture.tobytes() for moment in played.moments}) > 2


def test_containers_that_change_places_are_remarkable_as_soon_as_they_do():
    """In this episode containers appear at step 33 and change places at steps 90 and 140.

    `at` is asked for every step, in order, and gives the caption of what happens after it.
    """
    episode = get_episode("ButtonUnmaskSwap", "test", 3)
    key_events = KeyEvents(episode.scene.motions)

    captions = [str(key_events.at(step, 0)) for step in range(300)]

    swaps = [step for step, caption in enumerate(captions) if "change places" in caption]
    assert swaps == [90, 140]
    assert captions[33].endswith("container 3 appear")


def test_motions_of_a_stage_are_remarkable_from_then_on():
    """Stage 2 begins at step 80, and its swap 50 steps later, over 50 steps, so it is halfway at
    155. It is told at the next step, 156, and never before the stage. What goes under another
    object (`Away` with `under`) is not remarkable.
    """
    key_events = KeyEvents([Swap("a", "b", 50, 50, 0.1, stage=2), Away("c", 10, 60, under="a")])

    before = [step for step in range(80) if key_events.at(step, 0)]
    after = [step for step in range(80, 200) if key_events.at(step, 2)]

    assert (before, after) == ([], [156])
