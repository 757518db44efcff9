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
from roboirg.analysis.measures.measure import ALL_TASKS
from roboirg.analysis.measures.run_data import RunData
from roboirg.analysis.published import published_rows
from roboirg.analysis.results.frame import make_frame
from roboirg.core.failures import FAILURES
from roboirg.core.instruction_options import InstructionOptions
from roboirg.records.record import Summary
from roboirg.runs.plan.plan import Plan
from roboirg.stats.intervals import Interval

pytest.importorskip("matplotlib")

from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import to_hex
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle
from matplotlib.text import Text

PLAN = Plan(
    policies=("listener", "forgetful"),
    tasks=("PickXtimes", "VideoUnmask"),
    episodes=(0, 1, 2),
    forms=("implicit", "resolved"),
)


@functools.cache
def results() -> list[Summary]:
    return [*played(PLAN)]


def content(found: list[Summary] | None = None, **options: object) -> RunData:
    return RunData(make_frame([("run", results() if found is None else found)], **options))  # type: ignore[arg-type]


def drawn_texts(figure: Figure) -> list[Text]:
    """The texts of a figure that are seen, after it was laid out."""
    FigureCanvasAgg(figure).draw()
    owners = [*(panel for panel in figure.axes if panel.get_visible()), *figure.legends]
    found = [*figure.texts, *(text for owner in owners for text in owner.findobj(Text))]
    return [text for text in found if text.get_visible() and text.get_text()]


def words(text: Text) -> str:
    return " ".join(text.get_text().split())


def draw(name: str, found: RunData, *, published: bool = False) -> Figure:
    figure = draw_figure(name, found, published=published)
    assert figure is not None
    return figure


def dots(figure: Figure) -> dict[tuple[str, str], list[float]]:
    """Reference and rate, or the rate alone, by panel and label of the row, in percent."""
    found: dict[tuple[str, str], list[float]] = {}
    for panel in figure.axes:
        labels = dict(zip(panel.get_yticks(), figure.axes[0].get_yticklabels(), strict=True))
        for line in panel.lines:
            if line.get_marker() == "o":
                (x,), (y,) = line.get_data()
                key = panel.get_title(loc="left"), words(labels[y])
                found.setdefault(key, []).append(float(x))
    return found


@pytest.mark.slow
def test_all_figures_that_apply_are_written_and_are_the_same_again(tmp_path):
    paths = write_figures(
        content(planned=PLAN.jobs()), tmp_path / "a" / "b", ("gaps", "context", "failures")
    )
    # Nothing is known about contexts of other lengths.
    assert {path.name for path in paths} == {
        f"{name}{ending}"
        for name in ("gaps", "failures")
        for ending in (".png", ".svg", ".pdf", "-dark.png", "-dark.svg")
    }

    turned = content(results()[::-1], planned=PLAN.jobs())
    again = write_figures(turned, tmp_path / "again", ["gaps"])
    for first, second in zip(sorted(paths)[-5:], sorted(again), strict=True):
        assert first.read_bytes() == second.read_bytes(), first.name


def test_figures_are_not_written_through_links(tmp_path):
    (tmp_path / "victim").write_text("mine")
    (tmp_path / "gaps.png").symlink_to(tmp_path / "victim")

    write_figures(content(), tmp_path, ["gaps"])

    assert (tmp_path / "victim").read_text() == "mine"
    assert not (tmp_path / "gaps.png").is_symlink()


LIMITS = "Played on the test split, in our own words, with at most 1300 steps."


@pytest.mark.parametrize(
    ("name", "shown"),
    [
        ("gaps", ["listener (privileged), n = 3", "direct", "mean over 2 tasks", "−100"]),
        ("failures", ["grounding: wrong object", "n = 6", "direct (resolved)"]),
    ],
)
def test_figures_say_what_the_records_say(name, shown):
    texts = [words(drawn) for drawn in drawn_texts(draw(name, content()))]
    assert {*shown} <= {*texts}
    assert LIMITS in texts[0]


def widths(panel: Axes) -> dict[str, float]:
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


def test_bars_are_shares_of_what_was_played(monkeypatch):
    """Also those too short for a number: would catch one that the next part covers."""
    monkeypatch.setattr(failures, "MIN_LABELED_PERCENT", 20.0)
    found = content(planned=PLAN.jobs())
    failed = [result.attribution.failure for result in results() if result.attribution is not None]

    listener, forgetful = (widths(panel) for panel in draw("failures", found).axes)

    # Everything failed in the four implicit tellings, nothing in the rest.
    assert sum(listener.values()) == 0
    assert sum(forgetful.values()) == pytest.approx(400)
    for name, color in failures.COLORS.items():
        assert forgetful.get(color, 0) == pytest.approx(100 * failed.count(name) / 6)
    assert len({*failures.COLORS.values()}) == len(FAILURES) + 1


def test_gaps_are_those_of_the_summary():
    """And who lacks a trial is marked, of two policies that played the same otherwise."""
    found = content(planned=[*PLAN.jobs(), replace(PLAN.jobs()[0], policy_seed=1)])

    shown = dots(draw("gaps", found))

    names = {label.partition(",")[0] for _, label in shown}
    assert names == {"listener (privileged) (incomplete)", "forgetful (privileged)"}
    assert {setting for setting, _ in shown} == {"direct", "reasoning", "contextual", "spatial"}
    runs = {name: policy_run for policy_run, name in found.frame.names.items()}
    for (setting, label), (explicit, implicit) in shown.items():
        (policy_run,) = [run for name, run in runs.items() if label.startswith(name)]
        gap = found.summaries[policy_run, ALL_TASKS, InstructionOptions(setting)].gap
        assert implicit - explicit == pytest.approx(100 * gap.value)


@pytest.mark.parametrize(
    ("rate", "ends"),
    [
        (Rate(0.5, None, Interval(0.25, 0.625)), [25, 62.5]),
        (Rate(0.5, 0.75, Interval(-0.375, -0.125)), [37.5, 62.5]),
    ],
)
def test_bands_lie_around_their_rates(rate, ends):
    """The interval of a difference is drawn from the reference, not from the rate."""
    figure = draw_rates({"direct": ""}, [RateRow("a", {"direct": rate})], WORDS["main"], [])
    assert [*figure.axes[0].lines[0].get_xdata()] == ends


def test_published_gaps_are_over_the_tasks_of_their_setting():
    rows = {(row.model, row.options.setting): row for row in published_rows("main")}

    shown = dots(draw("gaps", content([]), published=True))

    assert len(shown) == 4 * len({model for model, _ in rows})
    for (setting, model), (explicit, implicit) in shown.items():
        row = rows[model, setting]
        played = [task for task, rate in row.rates.items() if rate is not None]
        average = rows[model, "explicit"].average_over(played)
        assert implicit == pytest.approx(float(row.average))
        assert explicit == pytest.approx(float(average or 0))


def test_there_is_no_figure_of_gaps_without_results():
    assert draw_figure("gaps", content([])) is None


def test_published_rows_stand_apart_and_signs_say_what_cannot_be_compared():
    """As in a table: one episode of our own next to 150 of the paper's has its n and its ≠."""
    found = [result for result in like_published("main", "MemER") if result.task == "PickXtimes"]
    first = next(result for result in found if (result.setting, result.episode) == ("direct", 0))

    figure = draw("gaps", content([first]), published=True)

    panel = figure.axes[0]
    labels = [words(label) for label in panel.get_yticklabels()]
    assert labels[:2] == ["MemER, n = 1 ≠", "published, n = 50 × 3"]
    assert len(labels) == 2 + len({row.model for row in published_rows("main")})

    (line,) = (line for line in panel.lines if [*line.get_xdata()] == [0, 1])
    own, heading = panel.get_yticks()[:2]
    assert own < line.get_ydata()[0] < heading  # type: ignore[index]

    texts = [words(text) for text in drawn_texts(figure)]
    assert "≠ Implicit settings are not comparable with the published rates" in texts[0]
    assert "PickXtimes" in texts


def test_no_sign_stands_where_nothing_published_is_drawn():
    found = [result for result in like_published("main", "MemER") if result.task == "PickXtimes"]
    assert "published" not in words(draw("gaps", content(found)).texts[0])


def test_the_context_is_compared_with_the_shortest_on_the_same_tasks():
    rates = {(row.model, row.options.stages): row.average for row in published_rows("context")}

    shown = dots(draw("context", content(like_published("context")), published=True))

    assert {title for title, _ in shown} == {"stages 1,2,5", "stages 1,2,3,5", "stages 1,2,3,4,5"}
    for (title, label), (shortest, rate) in shown.items():
        model, _, own = label.partition(",")
        stages = tuple(map(int, title.removeprefix("stages ").split(",")))
        near = 0.01 if own else 1e-9
        assert shortest == pytest.approx(float(rates[model, (1, 5)]), abs=near)
        assert rate == pytest.approx(float(rates[model, stages]), abs=near)


def test_there_is_no_figure_of_the_shortest_context_alone():
    found = like_published("context")
    shortest = [result for result in found if result.options.stages == (1, 5)]
    assert draw_figure("context", content(shortest)) is None


POLICIES_WITH_LONG_NAMES = (
    "my_package.policies:NetWithAVeryLongName, frames of the video none",
    "a" * 90,
    "b",
    "pickxtimes-recurrent-seed1",
    "c",
)


@pytest.mark.parametrize(("name", "count"), [("gaps", 5), ("context", 1), ("failures", 5)])
def test_no_text_leaves_the_figure_or_lies_on_another(name, count):
    found = like_published("context") if name == "context" else results()
    played = [result for result in found if result.policy in ("forgetful", "MemER")]
    many = []
    for policy in POLICIES_WITH_LONG_NAMES[:count]:
        many += [replace(result, policy=policy) for result in played]

    figure = draw(name, content(many), published=True)

    texts = drawn_texts(figure)
    assert any("NetWithA" in "".join(text.get_text().split()) for text in texts)
    boxes = {text: text.get_window_extent() for text in texts}
    for text, box in boxes.items():
        assert figure.bbox.x0 <= min(box.x0, figure.bbox.x1 - box.x1), text
        assert figure.bbox.y0 <= min(box.y0, figure.bbox.y1 - box.y1), text
    for (text, box), (other, other_box) in combinations(boxes.items(), 2):
        across = min(box.x1, other_box.x1) - max(box.x0, other_box.x0)
        down = min(box.y1, other_box.y1) - max(box.y0, other_box.y0)
        assert min(across, down) <= 1, (text, other)


@pytest.mark.parametrize("kept", ["explicit", "direct"])
def test_rates_without_another_setting_stand_alone(kept):
    found = content(
        [result for result in results() if result.setting == kept and result.form == "implicit"]
    )
    shown = dots(draw("gaps", found))
    assert {title for title, _ in shown} == {kept}

    own = [
        found.summaries[key, ALL_TASKS, InstructionOptions(kept)].rate for key in found.frame.names
    ]
    assert [*shown.values()] == [[100 * float(rate)] for rate in own if rate is not None]
