"""The figures: that they are there, say what the records say, and are the same again."""

from __future__ import annotations

import functools
from collections import defaultdict
from itertools import combinations

import pytest
from msgspec.structs import replace
from page_text import played
from published_results import like_published

from roboirg.analysis.figures import draw_figure, failures, write_figures
from roboirg.analysis.figures.gaps import WORDS
from roboirg.analysis.figures.rates import Rate, RateRow, draw_rates
from roboirg.analysis.measures.run_data import RunData
from roboirg.analysis.results.frame import make_frame
from roboirg.runs.plan.plan import Plan
from roboirg.stats.intervals import Interval

pytest.importorskip("matplotlib")

from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import to_hex
from matplotlib.patches import Rectangle
from matplotlib.text import Text

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
def test_wanted_figures_are_written_byte_for_byte_the_same_from_results_in_any_order(tmp_path):
    """Would find figures that change from run to run, so that a paper's cannot be made again."""
    first = tmp_path / "a" / "b"
    paths = write_figures(run_data(planned=PLAN.jobs()), first, ("gaps", "context", "failures"))

    turned = run_data(results_of_two_policies()[::-1], planned=PLAN.jobs())
    again = write_figures(turned, tmp_path / "again", ["gaps"])

    # The third, context, needs results of several context lengths; there are none.
    assert {path.name for path in paths} == {
        f"{name}{ending}"
        for name in ("gaps", "failures")
        for ending in (".png", ".svg", ".pdf", "-dark.png", "-dark.svg")
    }
    assert len(again) == 5
    for path in again:
        assert path.read_bytes() == (first / path.name).read_bytes(), path.name


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


def test_each_part_of_a_bar_is_as_long_as_its_share_of_the_played_episodes(monkeypatch):
    """Also parts too short for a number; would find one that is covered by the next.

    A bar is a setting, with 6 episodes. The forgetful policy loses all in four settings, so its
    bars add up to 400 %; the listener loses none. Two causes of failure may share a color.
    """
    monkeypatch.setattr(failures, "MIN_LABELED_PERCENT", 20.0)
    colors = [
        failures.COLORS[result.attribution.failure]
        for result in results_of_two_policies()
        if result.attribution is not None
    ]

    figure = drawn_figure("failures", run_data(planned=PLAN.jobs()))

    listener, forgetful = (bar_widths_by_color(panel) for panel in figure.axes)
    assert sum(listener.values()) == 0
    assert sum(forgetful.values()) == pytest.approx(400)
    for color in failures.COLORS.values():
        share = 100 * colors.count(color) / 6
        assert forgetful.get(color, 0) == pytest.approx(share), color


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
    """The line is between our only row and the heading *published*."""
    panel = figure_of_one_episode_next_to_the_paper.axes[0]

    labels = [text_without_line_breaks(label) for label in panel.get_yticklabels()]
    (line,) = (line for line in panel.lines if [*line.get_xdata()] == [0, 1])
    own, heading = panel.get_yticks()[:2]
    assert labels[1] == "published, n = 50 × 3"
    assert len(labels) == 2 + 5, "and five policies of the paper"
    assert own < line.get_ydata()[0] < heading


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
    found = [result for result in like_published("main", "MemER") if result.task == "PickXtimes"]

    figure = drawn_figure("gaps", run_data(found))

    assert "published" not in text_without_line_breaks(figure.texts[0])


def test_rates_of_each_context_length_are_drawn_from_those_of_the_shortest():
    """A context has up to five stages; the shortest, (1, 5), has the rate 29.11 in the paper.

    Our results have the same rate without rounding: 131 of 450 trials are 29.111….
    """
    figure = drawn_figure("context", run_data(like_published("context")), published=True)

    shown = dot_positions(figure)
    assert {title for title, _ in shown} == {"stages 1,2,5", "stages 1,2,3,5", "stages 1,2,3,4,5"}
    assert shown["stages 1,2,5", "FrameS-Modul"] == pytest.approx([29.11, 30.22])
    assert shown["stages 1,2,5", "FrameS-Modul, n = 50 × 3 ≠"] == pytest.approx(
        [29.1111, 30.2222], abs=1e-4
    )
    assert shown["stages 1,2,3,5", "FrameS-Modul"] == pytest.approx([29.11, 26.45])


def test_there_is_no_figure_of_the_shortest_context_alone():
    found = like_published("context")
    shortest = [result for result in found if result.options.stages == (1, 5)]
    assert draw_figure("context", run_data(shortest)) is None


POLICIES_WITH_LONG_NAMES = (
    "my_package.policies:NetWithAVeryLongName, frames of the video none",
    "a" * 90,
    "b",
    "pickxtimes-recurrent-seed1",
    "c",
)


@pytest.mark.parametrize(("name", "count"), [("gaps", 5), ("context", 1), ("failures", 5)])
def test_no_text_leaves_the_figure_or_lies_on_another(name, count):
    """With long names of policies; two texts may touch by a pixel."""
    found = like_published("context") if name == "context" else results_of_two_policies()
    played = [result for result in found if result.policy in ("forgetful", "MemER")]
    many = []
    for policy in POLICIES_WITH_LONG_NAMES[:count]:
        many += [replace(result, policy=policy) for result in played]

    figure = drawn_figure(name, run_data(many), published=True)

    texts = drawn_texts(figure)
    assert any("NetWithA" in "".join(text.get_text().split()) for text in texts)
    boxes = {text: text.get_window_extent() for text in texts}
    edge = figure.bbox
    for text, box in boxes.items():
        assert edge.x0 <= box.x0 < box.x1 <= edge.x1, text
        assert edge.y0 <= box.y0 < box.y1 <= edge.y1, text
    for (text, box), (other, other_box) in combinations(boxes.items(), 2):
        across = min(box.x1, other_box.x1) - max(box.x0, other_box.x0)
        down = min(box.y1, other_box.y1) - max(box.y0, other_box.y0)
        assert min(across, down) <= 1, (text, other)


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
