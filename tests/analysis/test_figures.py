"""The figures: that they are there, say what the records say, and are the same again."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import typer
from made_records import make_record
from msgspec.structs import replace
from typer.testing import CliRunner

from roboirg.cli.report_commands import figures
from roboirg.core.errors import InvalidValueError, UnknownNameError
from roboirg.core.instruction_options import InstructionOptions
from roboirg.evaluation.analysis.figures import FIGURES, write_figures
from roboirg.evaluation.analysis.figures.context import draw_context
from roboirg.evaluation.analysis.figures.failures import COLORS, draw_failures
from roboirg.evaluation.analysis.figures.figure_style import STYLE
from roboirg.evaluation.analysis.figures.forms import PARTS, draw_forms
from roboirg.evaluation.analysis.figures.gaps import draw_gaps
from roboirg.evaluation.analysis.published import published_rows
from roboirg.evaluation.analysis.stats.failure_counts import UNATTRIBUTED
from roboirg.evaluation.analysis.stats.run_data import RunData
from roboirg.evaluation.analysis.stats.run_summary import ALL
from roboirg.evaluation.analysis.tables.diagnostic_tables import (
    make_failure_table,
    make_forms_table,
)
from roboirg.evaluation.plan.plan import Plan
from roboirg.evaluation.records.record import Attribution, Summary
from roboirg.evaluation.records.store import RecordStore
from roboirg.judging.failure_attribution import EXECUTION, GROUNDING

pytest.importorskip("matplotlib")

import matplotlib as mpl
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle
from matplotlib.text import Text

PLAN = Plan(
    policies=("listener", "forgetful"),
    tasks=("PickXtimes", "VideoUnmask"),
    episodes=(0, 1, 2),
    forms=("implicit", "resolved"),
)


def results() -> list[Summary]:
    """The listener succeeds; the forgetful fails where it must remember."""
    found = []
    for number, job in enumerate(PLAN.jobs()):
        lost = job.policy == "forgetful" and job.form == "implicit" and job.setting != "explicit"
        kind = "execution" if number % 2 else "grounding"
        failure = (EXECUTION if number % 2 else GROUNDING)[number % 5]
        attribution = Attribution(kind=kind, failure=failure, step=9, sentence="So.")
        record = make_record(job, "failure" if lost else "success")
        found.append(replace(record, attribution=attribution if lost else None))
    return found


def content(found: list[Summary] | None = None, **options: object) -> RunData:
    return RunData.of([("run", results() if found is None else found)], **options)  # type: ignore[arg-type]


def texts(path: Path) -> str:
    """The words of an SVG file, which are in its comments where letters are outlines."""
    return path.read_text()


@pytest.mark.slow
def test_all_figures_that_apply_are_written_and_are_the_same_again(tmp_path: Path) -> None:
    paths = write_figures(content(planned=PLAN.jobs()), tmp_path / "a" / "b")
    names = {path.name for path in paths}
    assert {f"{name}.{ending}" for name in ("gaps", "forms", "failures")
            for ending in ("png", "svg", "pdf")} <= names  # fmt: skip
    assert "expressions.png" in names
    # Nothing is known about contexts of other lengths.
    assert not {name for name in names if name.startswith("context")}
    again = write_figures(content(results()[::-1], planned=PLAN.jobs()), tmp_path / "again")
    for first, second in zip(paths, again, strict=True):
        assert first.read_bytes() == second.read_bytes(), first.name


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("gaps", ["listener", "forgetful", "direct", "2 tasks", "−100"]),
        (
            "forms",
            ["only resolved", "all tasks", "counting", "permanence", "−100 [−100, −", "±0 ["],
        ),
        ("failures", ["grounding: wrong object", "none", "direct (resolved)"]),
    ],
)
def test_figures_say_what_the_records_say(tmp_path: Path, name: str, words: list[str]) -> None:
    write_figures(content(), tmp_path, [name])
    drawn = texts(tmp_path / f"{name}.svg")
    for word in words:
        assert f"<!-- {word}" in drawn, word


def widths(panel: Axes) -> dict[str, list[float]]:
    """The lengths of a panel's bars by color, from the top down."""
    from matplotlib.colors import to_hex

    found: dict[str, list[float]] = {}
    for bar in panel.patches:
        assert isinstance(bar, Rectangle)
        found.setdefault(to_hex(bar.get_facecolor()).lower(), []).append(bar.get_width())
    return found


def test_the_forms_bars_are_the_overlap() -> None:
    drawn = draw_forms(content(planned=PLAN.jobs()))
    assert drawn is not None
    listener, forgetful = (widths(panel) for panel in drawn.axes)
    both, resolved, implicit, neither = (color.lower() for _, color, _ in PARTS)
    assert set(listener[both]) == set(forgetful[resolved]) == {100.0}
    assert {*listener[resolved], *forgetful[both], *forgetful[implicit], *forgetful[neither]} == {0}


def test_the_failures_bars_are_shares_of_what_was_played() -> None:
    found = content(planned=PLAN.jobs())
    drawn = draw_failures(found)
    assert drawn is not None
    listener, forgetful = (widths(panel) for panel in drawn.axes)
    assert listener == {}
    # Everything failed in the four implicit tellings, nothing in the rest.
    assert sum(map(sum, forgetful.values())) == pytest.approx(400)
    miscounted = sum(
        one.attribution is not None and one.attribution.failure == "wrong_count"
        for one in results()
    )
    assert sum(forgetful[COLORS["wrong_count"]]) == pytest.approx(100 * miscounted / 6)


def test_published_values_are_ghosts_on_request(
    tmp_path: Path, published_like: Callable[..., list[Summary]]
) -> None:
    found = content(published_like("context"))
    write_figures(found, tmp_path / "with", ["context"], published=True)
    write_figures(found, tmp_path / "without", ["context"])
    drawn = texts(tmp_path / "with" / "context.svg")
    for row in published_rows("context"):
        assert f"<!-- {row.model} (published)" in drawn
        summary = found.summaries[
            next(who for who in found.names if who.policy == row.model), ALL, row.options
        ]
        assert float(summary.rate) == pytest.approx(float(row.average) / 100, abs=1e-4)
    assert "(published)" not in texts(tmp_path / "without" / "context.svg")
    assert "1,2,3,4,5" in drawn


def test_the_context_is_compared_on_the_same_tasks(
    tmp_path: Path, published_like: Callable[..., list[Summary]]
) -> None:
    found = published_like("context")
    short = [one for one in found if not (one.task == "BinFill" and one.options.stages == (1, 5))]
    write_figures(content(short), tmp_path, ["context"])
    drawn = texts(tmp_path / "context.svg")
    assert "PickXtimes" in drawn
    assert "BinFill" not in drawn
    only = content([one for one in found if one.options.stages == (1, 5)])
    with pytest.raises(InvalidValueError, match="nothing to draw for context"):
        write_figures(only, tmp_path, ["context"])


def test_published_means_are_over_the_tasks_that_all_policies_played(
    published_like: Callable[..., list[Summary]],
) -> None:
    found = [
        replace(one, policy=policy)
        for one in published_like("main", "MemER")
        for policy, tasks in (
            ("wide", ("BinFill", "PickXtimes", "StopCube")),
            ("narrow", ("BinFill", "PickXtimes")),
        )
        if one.task in tasks
    ]
    drawn = draw_gaps(content(found), published=True)
    assert drawn is not None
    titles = {panel.get_title(loc="right") for panel in drawn.axes if panel.get_visible()}
    assert titles == {"2 tasks"}
    explicit = next(
        row for row in published_rows("main")
        if row.model == "MemER" and row.options.setting == "explicit"
    )  # fmt: skip
    both = explicit.average_over(("BinFill", "PickXtimes"))
    assert shown_gaps(drawn)["direct", "MemER (published)"][0] == float(both) == 62.0
    everything = [task for task, rate in explicit.rates.items() if rate is not None]
    assert explicit.average_over(everything) == explicit.average
    assert explicit.average_over(["BinFill", "MyTask"]) is explicit.average_over([]) is None


def test_published_values_need_shared_tasks(published_like: Callable[..., list[Summary]]) -> None:
    """Policies without a common task have no figure; tasks outside the paper no published mean."""
    found = [
        replace(one, policy=one.task)
        for one in published_like("main", "MemER")
        if one.task in ("BinFill", "StopCube")
    ]
    assert any(one.setting == "spatial" for one in found)
    shared = draw_gaps(content(found), published=True)
    assert shared is not None  # spatial has one of the two tasks only
    assert {panel.get_title(loc="left") for panel in shared.axes} == {"spatial"}
    real = draw_gaps(content(published_like("real")), published=True)
    assert real is not None
    assert not any("published" in name.get_text() for name in real.axes[0].get_yticklabels())


def test_scenes_are_counted_in_whole_numbers(tmp_path: Path) -> None:
    write_figures(content(), tmp_path, ["expressions"])
    drawn = texts(tmp_path / "expressions.svg")
    assert "<!-- 6 -->" in drawn
    assert not re.search(r"<!-- \d+\.\d+ -->", drawn)


@pytest.mark.parametrize("draw", [draw_context, draw_failures, draw_forms, draw_gaps])
def test_no_name_leaves_the_figure(
    draw: Callable[[RunData], Figure | None], published_like: Callable[..., list[Summary]]
) -> None:
    long = "my_package.policies:NetWithAVeryLongName, frames of the video none"
    found = [
        replace(one, policy=long if one.policy == "forgetful" else "a" * 90)
        for one in (published_like("context") if draw is draw_context else results())
    ]
    with mpl.rc_context(STYLE):  # type: ignore[arg-type]
        drawn = draw(content(found))
        assert drawn is not None
        FigureCanvasAgg(drawn).draw()
    edges = drawn.bbox
    names = [
        text
        for text in drawn.findobj(Text)
        if "NetWith" in text.get_text() or "aaaa" in text.get_text()
    ]
    assert names
    for text in names:
        box = text.get_window_extent()
        assert edges.x0 <= box.x0
        assert box.x1 <= edges.x1
        assert edges.y0 <= box.y0
        assert box.y1 <= edges.y1


def test_what_is_incomplete_is_called_so(tmp_path: Path) -> None:
    write_figures(content(results()[:-2], planned=PLAN.jobs()), tmp_path, ["gaps"])
    drawn = texts(tmp_path / "gaps.svg")
    assert "(incomplete)" in drawn
    assert "<!-- listener (privileged) -->" in drawn


def test_every_failure_has_a_color_of_its_own() -> None:
    assert set(COLORS) == {*GROUNDING, *EXECUTION, UNATTRIBUTED}
    assert len(set(COLORS.values())) == len(COLORS)


def test_runs_that_hold_the_same_episodes_stand_apart(tmp_path: Path) -> None:
    both = RunData.of([("one", results()), ("two", results())])
    assert set(both.names.values()) == {
        f"{policy}, {run} (privileged)"
        for policy in ("listener", "forgetful")
        for run in ("one", "two")
    }
    assert {who.run for who, _ in both.results} == {"one", "two"}
    write_figures(both, tmp_path, ["failures"])
    assert "<!-- forgetful, two" in texts(tmp_path / "failures.svg")


def test_wrong_names_and_places_are_one_sentence(tmp_path: Path) -> None:
    with pytest.raises(UnknownNameError, match="Did you mean 'gaps'"):
        write_figures(content(), tmp_path, ["gap"])
    (tmp_path / "file").write_text("")
    with pytest.raises(InvalidValueError, match="Cannot write to"):
        write_figures(content(), tmp_path / "file", ["gaps"])
    happy = [one for one in results() if one.outcome == "success"]
    with pytest.raises(InvalidValueError, match="nothing to draw for failures"):
        write_figures(content(happy), tmp_path, ["failures"])


def test_the_command_draws_what_it_is_asked_for(tmp_path: Path) -> None:
    app = typer.Typer()
    app.command()(figures)
    with RecordStore(tmp_path / "run") as store:
        for one in results():
            store.append(one)  # type: ignore[arg-type]
    out = tmp_path / "figures"
    asked = [str(tmp_path / "run"), "--out", str(out), "--which", "gaps, failures"]
    done = CliRunner().invoke(app, asked, catch_exceptions=False)
    assert done.exit_code == 0
    assert sorted(path.name for path in out.iterdir()) == sorted(
        f"{name}{ending}"
        for name in ("gaps", "failures")
        for ending in (".png", ".svg", ".pdf", "-dark.png", "-dark.svg")
    )
    assert str(out / "gaps.pdf") in done.output
    assert set(FIGURES) >= {"gaps", "failures"}
    assert InstructionOptions("explicit") in {options for _, _, options in content().cells}


@pytest.mark.parametrize("kept", ["explicit", "direct"])
def test_rates_without_another_setting_stand_alone(kept: str) -> None:
    assert draw_gaps(RunData.of([])) is draw_forms(RunData.of([])) is None
    found = content([one for one in results() if one.setting == kept and one.form == "implicit"])
    drawn = draw_gaps(found, published=True)
    assert drawn is not None
    (panel,) = drawn.axes
    assert panel.get_title(loc="left") == kept
    dots = [line.get_xdata()[0] for line in panel.lines if line.get_marker() == "o"]  # type: ignore[index]
    own = [found.summaries[key, ALL, InstructionOptions(kept)].rate for key in found.names]
    assert dots[: len(own)] == [100 * float(rate) for rate in own if rate is not None]


def shown_gaps(drawn: Figure) -> dict[tuple[str, str], tuple[float, float, str]]:
    """Explicit and implicit rate and the printed gap, by setting and policy."""
    names = [label.get_text().replace("\n", " ") for label in drawn.axes[0].get_yticklabels()]
    found = {}
    for panel in drawn.axes:
        dots = [line for line in panel.lines if line.get_marker() == "o"]
        for place in range(len(dots) // 2):
            explicit, implicit = dots[2 * place : 2 * place + 2]
            policy = names[round(float(explicit.get_ydata()[0]))]  # type: ignore[index,arg-type]
            found[panel.get_title(loc="left"), policy] = (
                float(explicit.get_xdata()[0]),  # type: ignore[index,arg-type]
                float(implicit.get_xdata()[0]),  # type: ignore[index,arg-type]
                panel.texts[place].get_text(),
            )
    return found


def test_gaps_of_a_run_are_the_summary_s() -> None:
    found = content(planned=PLAN.jobs())
    drawn = draw_gaps(found)
    assert drawn is not None
    shown = shown_gaps(drawn)
    assert {setting for setting, _ in shown} == {"direct", "reasoning", "contextual", "spatial"}
    for (setting, policy), (explicit, implicit, text) in shown.items():
        key = next(one for one, name in found.names.items() if name == policy)
        gap = found.summaries[key, ALL, InstructionOptions(setting)].gap
        assert gap is not None
        assert implicit - explicit == pytest.approx(100 * gap.value)
        assert text == ("±0" if policy.startswith("listener") else "−100")


def test_published_gaps_are_over_the_tasks_of_their_setting() -> None:
    drawn = draw_gaps(RunData.of([]), published=True)
    assert drawn is not None
    shown = shown_gaps(drawn)
    rows = {(row.model, row.options.setting): row for row in published_rows("main")}
    models = {model for model, _ in rows}
    assert len(shown) == 4 * len(models)
    for (setting, policy), (explicit, implicit, _) in shown.items():
        model = policy.removesuffix(" (published)")
        assert implicit == pytest.approx(float(rows[model, setting].average))
        played = [task for task, rate in rows[model, setting].rates.items() if rate is not None]
        mean = rows[model, "explicit"].average_over(played)
        assert mean is not None
        assert explicit == pytest.approx(float(mean))
    assert draw_gaps(RunData.of([])) is None


def test_the_tables_of_forms_and_failures_are_the_figures_numbers() -> None:
    found = content(planned=PLAN.jobs())
    forms = make_forms_table(found)
    for row in forms.rows:
        trials, both, resolved, implicit, neither = (int(one.word) for one in row.entries[:5])
        is_listener = row.group.startswith("listener")
        assert (both, resolved) == ((trials, 0) if is_listener else (0, trials))
        assert implicit == neither == 0
        assert row.entries[5].word == ("±0.0" if is_listener else "−100.0")
    failures = make_failure_table(found)
    names = [column.name for column in failures.columns]
    drawn = draw_failures(found)
    assert drawn is not None
    counted = names.index("wrong count")
    total = sum(
        int(row.entries[counted].word.split()[0])
        for row in failures.rows
        if row.name != "all tasks"
    )
    assert total == sum(
        one.attribution is not None and one.attribution.failure == "wrong_count"
        for one in results()
    )
    for row in failures.rows:
        kinds = [int(entry.word.split()[0]) for entry in row.entries[2:]]
        assert sum(kinds) == int(row.entries[1].word) <= int(row.entries[0].word)


def test_a_share_of_failures_is_that_of_the_failures(
    cell_of: Callable[..., list[Summary]],
) -> None:
    """As in the paper: nine wrong targets are 69 % of the 13 failures of twenty trials."""
    spatial = InstructionOptions("spatial")
    rng = np.random.default_rng(1)
    found = list(cell_of(7, 20, 1, rng, spatial, policy="pi0.5", task="PutInBox"))
    failed = iter(["wrong_object"] * 9 + ["missed_grasp"] * 4)
    found = [
        replace(
            one, attribution=Attribution(kind="grounding", failure=next(failed), sentence="So.")
        )
        if one.outcome == "failure"
        else one
        for one in found
    ]
    table = make_failure_table(RunData.of([("", found)]))
    (row,) = table.rows
    assert [column.name for column in table.columns][2:] == ["wrong object", "missed grasp"]
    assert [entry.word for entry in row.entries] == ["20", "13", "9 (69 %)", "4 (31 %)"]
    with pytest.raises(InvalidValueError, match="No episode of the runs failed"):
        make_failure_table(RunData.of([("", [one for one in found if one.outcome == "success"])]))
    with pytest.raises(InvalidValueError, match="--forms implicit,resolved"):
        make_forms_table(RunData.of([("", found)]))
