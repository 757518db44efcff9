"""The figures: that they are there, say what the records say, and are the same again."""

from __future__ import annotations

import functools
import re
from collections import defaultdict
from itertools import combinations
from pathlib import Path

import pytest
from flat_jobs import make_result, make_results
from msgspec.structs import replace
from page_text import played
from published_results import like_published

from roboirg.analysis import palette
from roboirg.analysis.figures import draw_figure, write_figures
from roboirg.analysis.figures.failures import failure_colors
from roboirg.analysis.figures.gaps import WORDS
from roboirg.analysis.figures.rates import Rate, RateRow, draw_rates
from roboirg.analysis.measures.run_data import RunData
from roboirg.analysis.results.frame import make_frame
from roboirg.records.record import Attribution
from roboirg.runs.plan.plan import Plan
from roboirg.stats.intervals import Interval

pytest.importorskip("matplotlib")

from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import to_hex
from matplotlib.patches import Rectangle
from matplotlib.text import Text
from matplotlib.transforms import Bbox

PLAN = Plan(
    policies=("listener", "forgetful"),
    tasks=("PickXtimes", "VideoUnmask"),
    episodes=(0, 1, 2),
    forms=("implicit", "resolved"),
)


@functools.cache
def results_of_two_policies():
    """Return results of which the forgetful policy loses all implicit ones, the listener none."""
    return [*played(PLAN)]


def run_data(found=None, **options):
    """Return what figures are drawn from: these results, or those of the two policies."""
    if found is None:
        found = results_of_two_policies()
    return RunData(make_frame([("run", found)], **options))


def drawn_texts(figure):
    """The texts of a figure that are seen, after it was laid out."""
    FigureCanvasAgg(figure).draw()
    owners = [*(panel for panel in figure.axes if panel.get_visible()), *figure.legends]
    found = [*figure.texts, *(text for owner in owners for text in owner.findobj(Text))]
    return [text for text in found if text.get_visible() and text.get_text()]


def text_without_line_breaks(text):
    return " ".join(text.get_text().split())


def drawn_figure(name, found, *, published=False):
    """Return a figure that has something to show, next to the published rates or without them."""
    figure = draw_figure(name, found, published=published)
    assert figure is not None
    return figure


def dot_positions(figure):
    """Return where the dots of each row stand, in percent, by panel and label of the row.

    A row has two dots, the reference and the rate, or the rate alone, as in
    ``{("direct", "listener"): [100.0, 50.0]}``.
    """
    found: dict[tuple[str, str], list[float]] = {}
    for panel in figure.axes:
        labels = dict(zip(panel.get_yticks(), figure.axes[0].get_yticklabels(), strict=True))
        for line in panel.lines:
            if line.get_marker() == "o":
                (x,), (y,) = line.get_data()
                key = panel.get_title(loc="left"), text_without_line_breaks(labels[y])
                found.setdefault(key, []).append(float(x))
    return found


@pytest.mark.slow
def test_wanted_figures_are_written_in_every_format_if_they_have_something_to_show(tmp_path):
    """The figure of contexts needs results of several lengths of the context; there are none."""
    paths = write_figures(run_data(), tmp_path / "new" / "folder", ("gaps", "context"))

    expected = {"gaps.png", "gaps.svg", "gaps.pdf", "gaps-dark.png", "gaps-dark.svg"}
    assert {path.name for path in paths} == expected


@pytest.mark.slow
def test_figures_are_byte_for_byte_the_same_from_results_in_any_order(tmp_path):
    """Would find figures that change from run to run, so that a paper's cannot be made again."""
    results = results_of_two_policies()
    in_order = run_data(results, planned=PLAN.jobs())
    reversed_order = run_data(results[::-1], planned=PLAN.jobs())

    paths = write_figures(in_order, tmp_path / "first", ["gaps"])
    write_figures(reversed_order, tmp_path / "again", ["gaps"])

    assert len(paths) == 5, "formats"
    for path in paths:
        assert path.read_bytes() == (tmp_path / "again" / path.name).read_bytes(), path.name


def test_a_link_with_the_name_of_a_figure_is_replaced_and_its_target_stays(tmp_path):
    """Would find that drawing overwrites a file elsewhere, to which somebody else's link leads."""
    (tmp_path / "victim").write_text("mine")
    (tmp_path / "gaps.png").symlink_to(tmp_path / "victim")

    write_figures(run_data(), tmp_path, ["gaps"])

    assert (tmp_path / "victim").read_text() == "mine"
    assert not (tmp_path / "gaps.png").is_symlink()


CONDITIONS_BELOW_A_FIGURE = "Played on the test split, in our own words, with at most 1300 steps."


@pytest.mark.parametrize(
    ("name", "shown"),
    [
        ("gaps", ["listener (privileged), n = 3", "direct", "mean over 2 tasks", "−100"]),
        ("failures", ["grounding: wrong object", "n = 6", "direct (resolved)"]),
    ],
)
def test_a_figure_has_its_labels_its_counts_and_the_conditions_of_its_runs(name, shown):
    """Three episodes in each of two tasks were played."""
    figure = drawn_figure(name, run_data())

    texts = [text_without_line_breaks(text) for text in drawn_texts(figure)]
    assert {*shown} <= {*texts}
    assert CONDITIONS_BELOW_A_FIGURE in texts[0]


def bar_widths_by_color(panel):
    """The length of a panel's bars by color; each part of a bar begins where the last one ends."""
    found: dict[str, float] = {}
    ends: defaultdict[float, float] = defaultdict(float)
    for bar in panel.patches:
        assert isinstance(bar, Rectangle)
        assert bar.get_x() == pytest.approx(ends[bar.get_y()])
        ends[bar.get_y()] += bar.get_width()
        color = to_hex(bar.get_facecolor()).lower()
        found[color] = found.get(color, 0.0) + bar.get_width()
    return found


def test_each_part_of_a_bar_is_as_long_as_its_share_of_the_played_episodes():
    """Of 20 episodes 10 are won; 9 failed with the wrong object, and in one it was dropped.

    So the bar has parts of 45 and 5 %, and the rest is empty. The second is too short to have its
    number in it. Would find a part that is covered by the next.
    """
    wrong_object = Attribution(kind="grounding", failure="wrong_object", sentence="Made up.")
    dropped = Attribution(kind="execution", failure="dropped", sentence="Made up.")
    results = make_results("1" * 10)
    for episode in range(10, 19):
        results.append(make_result("failure", episode, attribution=wrong_object))
    results.append(make_result("failure", 19, attribution=dropped))

    figure = drawn_figure("failures", run_data(results))

    (panel,) = figure.axes
    expected = {failure_colors()["wrong_object"]: 45, failure_colors()["dropped"]: 5}
    assert bar_widths_by_color(panel) == pytest.approx(expected)


def test_the_dots_of_a_policy_are_its_explicit_and_its_implicit_rate():
    """The listener wins everything, the forgetful policy nothing but explicit episodes."""
    shown = dot_positions(drawn_figure("gaps", run_data()))

    assert len(shown) == 2 * 4, "two policies and four settings"
    for setting in ("direct", "reasoning", "contextual", "spatial"):
        assert shown[setting, "listener (privileged), n = 3"] == [100.0, 100.0]
        assert shown[setting, "forgetful (privileged), n = 3"] == [100.0, 0.0]


def test_a_policy_that_lacks_a_planned_trial_is_marked_as_incomplete():
    """The listener has one more planned, with another policy seed."""
    missing = replace(PLAN.jobs()[0], policy_seed=1)

    shown = dot_positions(drawn_figure("gaps", run_data(planned=[*PLAN.jobs(), missing])))

    names = {label.partition(",")[0] for _, label in shown}
    assert names == {"listener (privileged) (incomplete)", "forgetful (privileged)"}


@pytest.mark.parametrize(
    ("rate", "ends"),
    [
        (Rate(0.5, None, Interval(0.25, 0.625)), [25, 62.5]),
        (Rate(0.5, 0.75, Interval(-0.375, -0.125)), [37.5, 62.5]),
    ],
    ids=["rate", "difference"],
)
def test_an_interval_is_drawn_around_its_rate(rate, ends):
    """Of a difference to a reference, 0.75, it is added to the reference: 0.75 - 0.375 = 37.5 %."""
    figure = draw_rates({"direct": ""}, [RateRow("a", {"direct": rate})], WORDS["main"], [])

    assert [*figure.axes[0].lines[0].get_xdata()] == ends


def test_a_published_gap_is_over_the_tasks_that_have_its_setting():
    """All 11 tasks have direct; with the 4 that lack places, MemER's explicit rate is lower."""
    shown = dot_positions(drawn_figure("gaps", run_data([]), published=True))

    assert len(shown) == 4 * 5, "four settings and five policies"
    assert shown["direct", "MemER"] == pytest.approx([42.91, 32.67])
    assert shown["spatial", "MemER"] == pytest.approx([55.33, 26.29])


def test_there_is_no_figure_of_gaps_without_results():
    assert draw_figure("gaps", run_data([])) is None


@pytest.fixture
def figure_of_one_episode_next_to_the_paper():
    """One won or lost episode of MemER, next to the paper's rates of 50 episodes and 3 seeds."""
    for result in like_published("main", "MemER"):
        if (result.task, result.setting) == ("PickXtimes", "direct"):
            return drawn_figure("gaps", run_data([result]), published=True)
    raise LookupError("direct")


def test_published_rows_stand_below_a_line(figure_of_one_episode_next_to_the_paper):
    """The rows of a panel are our only policy, a heading, and the five policies of the paper.

    Between the first two is the only line that goes across the whole panel, from 0 to 1. Places of
    rows and lines are counted from the top down.
    """
    panel = figure_of_one_episode_next_to_the_paper.axes[0]

    labels = [text_without_line_breaks(label) for label in panel.get_yticklabels()]
    (line,) = [line for line in panel.lines if [*line.get_xdata()] == [0, 1]]

    assert labels[:2] == ["MemER, n = 1 ≠", "published, n = 50 × 3"]
    assert len(labels) == 7
    place_of_ours, place_of_heading, *_ = panel.get_yticks()
    assert place_of_ours < line.get_ydata()[0] < place_of_heading


def test_own_rates_that_cannot_be_compared_with_the_papers_have_a_sign(
    figure_of_one_episode_next_to_the_paper,
):
    """The figure shows one own episode next to rates of the paper; the sign is explained on top."""
    figure = figure_of_one_episode_next_to_the_paper

    texts = [text_without_line_breaks(text) for text in drawn_texts(figure)]
    assert "MemER, n = 1 ≠" in texts
    assert "≠ Implicit settings are not comparable with the published rates" in texts[0]
    assert "PickXtimes" in texts


def test_a_figure_without_published_rates_does_not_mention_them():
    """Results with the rates of the paper's MemER in one task are drawn alone."""
    found = [result for result in like_published("main", "MemER") if result.task == "PickXtimes"]

    figure = drawn_figure("gaps", run_data(found))

    assert "published" not in text_without_line_breaks(figure.texts[0])


def test_rates_of_each_context_length_are_drawn_from_those_of_the_shortest():
    """A row has two dots: the rate with the shortest context, stages 1 and 5, and the panel's.

    In the paper the policy FrameS-Modul has 29.11 % with stages 1 and 5, 30.22 % with 1, 2, 5 and
    26.45 % with 1, 2, 3, 5. Results with as many wins as in the paper, 131 and 136 of 450 trials,
    have a row of their own (≠), whose rates are not rounded.
    """
    results = like_published("context")

    dots = dot_positions(drawn_figure("context", run_data(results), published=True))

    assert {title for title, _ in dots} == {"stages 1,2,5", "stages 1,2,3,5", "stages 1,2,3,4,5"}
    assert dots["stages 1,2,5", "FrameS-Modul"] == pytest.approx([29.11, 30.22])
    assert dots["stages 1,2,3,5", "FrameS-Modul"] == pytest.approx([29.11, 26.45])
    ours = dots["stages 1,2,5", "FrameS-Modul, n = 50 × 3 ≠"]
    assert ours == pytest.approx([100 * 131 / 450, 100 * 136 / 450])


def test_there_is_no_figure_of_the_shortest_context_alone():
    """The figure shows how success changes with more stages of context than 1 and 5."""
    found = like_published("context")
    shortest = [result for result in found if result.options.stages == (1, 5)]
    assert draw_figure("context", run_data(shortest)) is None


def results_under_long_names(results, policy):
    """Return the results of a policy again and again, under long and short names of policies."""
    names = ("my.policies:NetWithAVeryLongName, frames of the video none", "a" * 90, "b")
    own = [result for result in results if result.policy == policy]
    found = []
    for name in names:
        found += [replace(result, policy=name) for result in own]
    return found


def pixels_of_overlap(box, other):
    """Return by how many pixels two boxes would have to move apart; below 0 they are apart."""
    across = min(box.x1, other.x1) - max(box.x0, other.x0)
    down = min(box.y1, other.y1) - max(box.y0, other.y0)
    return min(across, down)


@pytest.mark.parametrize("name", ["gaps", "failures", "context"])
def test_no_text_leaves_the_figure_or_lies_on_another(name):
    """Each figure shows three policies, one with a long name and one with a name of 90 letters.

    They are folded, so that there is room for all texts: two of them may touch by a pixel. The
    figure of contexts has the results of the paper's MemER, the others those of the forgetful
    policy.
    """
    if name == "context":
        results = results_under_long_names(like_published("context"), "MemER")
    else:
        results = results_under_long_names(results_of_two_policies(), "forgetful")

    figure = drawn_figure(name, run_data(results), published=True)

    boxes = {text: text.get_window_extent() for text in drawn_texts(figure)}
    assert any("VeryLong" in text.get_text() for text in boxes)
    for text, box in boxes.items():
        with_text = Bbox.union([figure.bbox, box])  # larger if the text leaves the figure
        assert with_text.extents.tolist() == figure.bbox.extents.tolist(), text
    for (text, box), (other, other_box) in combinations(boxes.items(), 2):
        assert pixels_of_overlap(box, other_box) <= 1, (text, other)


@pytest.mark.parametrize(
    ("setting", "rates"),
    [("explicit", [[100], [100]]), ("direct", [[0], [100]])],
)
def test_results_of_one_setting_are_drawn_as_rates_without_a_gap(setting, rates):
    """A dot for the forgetful policy, which wins explicit alone, and one for the listener."""
    found = [
        result
        for result in results_of_two_policies()
        if (result.setting, result.form) == (setting, "implicit")
    ]

    shown = dot_positions(drawn_figure("gaps", run_data(found)))

    assert {title for title, _ in shown} == {setting}
    assert [*shown.values()] == rates


def test_colors_of_the_page_and_of_figures_stand_in_the_palette_alone():
    """Would find a color of its own, which the page or a figure has beside the palette."""
    files = Path(palette.__file__).parent.rglob("*.*[sy2l]")
    color = rb"#[0-9a-fA-F]{6}\b"

    assert [file.name for file in files if re.search(color, file.read_bytes())] == ["palette.toml"]
