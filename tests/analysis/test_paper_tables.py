"""Tables mark incomplete cells, errors, single policies and several versions."""

from __future__ import annotations

import csv
import io
import re
from decimal import Decimal
from fractions import Fraction
from pathlib import Path

import pytest
from flat_jobs import with_version
from hypothesis import given
from hypothesis import strategies as st
from msgspec.structs import replace
from rich.console import Console

from roboirg.evaluation.analysis.results.frame import Frame, make_frame
from roboirg.evaluation.analysis.stats.chance import CHANCE
from roboirg.evaluation.analysis.stats.rates import mean_percent, percent
from roboirg.evaluation.analysis.stats.run_data import RunData
from roboirg.evaluation.analysis.tables.paper_tables import WHICH, is_informative, make_table
from roboirg.evaluation.analysis.tables.rendering import get_format
from roboirg.evaluation.analysis.tables.rendering.terminal import renderable
from roboirg.evaluation.analysis.tables.table import Table
from roboirg.language.settings import settings_of
from roboirg.language.templates import LANGUAGE_VERSION
from roboirg.tasks import all_tasks


@given(st.integers(1, 5000).flatmap(lambda n: st.tuples(st.integers(0, n), st.just(n))))
def test_rates_are_rounded_half_up_once(counts: tuple[int, int]) -> None:
    exact = 100 * Fraction(*counts)
    printed = Fraction(percent(Fraction(*counts)))
    assert Fraction(-1, 200) < printed - exact <= Fraction(1, 200)
    assert str(percent(Fraction(*counts)))[-3] == "."
    # So are means of printed rates.
    rate = percent(Fraction(*counts))
    assert mean_percent([rate, more := rate + Decimal("0.01")]) == more


PRINTED = Path(__file__).with_name("printed_main_table.md")


def entries(table: Table, group: str, name: str | None = None, source: str = "ours"):
    """Return the entries of a row by column."""
    (row,) = [
        row
        for row in table.rows
        if row.group == group and row.source == source and name in (None, row.name)
    ]
    return dict(zip((column.name for column in table.columns), row.entries, strict=True))


def whole(result, policy: str = "a", settings=("explicit", "direct"), **fields) -> list:
    """Two episodes of every task that has the setting, the first won."""
    return [
        result(outcome, episode, policy=policy, task=name, setting=setting, **fields)
        for name, task in all_tasks().items()
        for setting in settings
        if setting in settings_of(task)
        for episode, outcome in enumerate(("success", "failure"))
    ]


def table_of(which: str, *results: list, planned=(), **options) -> Table:
    return make_table(which, RunData(frame_of(*results, planned=planned)), **options)


def frame_of(*results: list, planned=()) -> Frame:
    return make_frame([("run", [one for own in results for one in own])], planned)


def test_what_is_incomplete_is_marked_and_compared_with_nothing(result) -> None:
    """The good policy wins all of BinFill and of the spatial setting.

    The poor one has an error of ButtonUnmask in direct, and an episode of StopCube still to play in
    explicit; nobody played PickXtimes. What is of other options or tasks is named below.
    """
    settings = ("explicit", "direct", "spatial")
    good, poor = (
        [one for one in whole(result, name, settings, split="val") if one.task != "PickXtimes"]
        for name in ("good", "poor")
    )
    good = [
        replace(one, outcome="success") if "BinFill" in one.task or "sp" in one.setting else one
        for one in good
    ]
    planned = [one.identity for one in (*good, *poor)]
    missing = ("StopCube", "explicit", 1)
    poor = [one for one in poor if (one.task, one.setting, one.episode) != missing]
    poor += [
        result("error", 2, policy="poor", task="ButtonUnmask", setting="direct", split="val"),
        result(
            "failure",
            0,
            policy="poor",
            task="BinFill",
            setting="direct",
            form="resolved",
            split="val",
        ),
        result("failure", 0, policy="poor", task="Other", split="val"),
    ]
    table = table_of("main", good, poor, planned=planned, floors=(CHANCE,))
    assert get_format("markdown").draw(table) == PRINTED.read_text("utf-8")


def test_results_in_another_language_stand_next_to_its_own_explicit_and_floors(result) -> None:
    """A gap to another language's explicit, or its learned floors, would be of other words."""
    three, four = (
        [
            result(outcome, setting=setting, language=language, language_version=version)
            for setting, outcome in (("explicit", "success"), ("direct", "failure"))
        ]
        for language, version in ((3, LANGUAGE_VERSION), (4, "4.none"))
    )
    table = table_of("main", three, four, floors=(CHANCE, "text-only"))
    rows = {(row.group, row.name): row.entries[1] for row in table.rows}
    for version in (LANGUAGE_VERSION, "4.none"):
        assert rows["direct", f"listener, language {version}"].change == -100
        assert rows["direct", f"{CHANCE}, language {version}"].percent is not None
    assert ("direct", f"text-only, language {LANGUAGE_VERSION}") in rows
    assert ("direct", "text-only, language 4.none") not in rows
    assert "No learned floors (text-only) were measured for language version 4.none." in table.notes
    assert table_of("main", four, floors=(CHANCE,)).rows[1].name == CHANCE


def test_each_split_has_floors_of_its_own(result) -> None:
    """A mean over both would be no chance of either."""
    runs = [
        [result(split=split, task="BinFill", setting="direct", episode=at) for at in range(9)]
        for split in ("test", "val")
    ]
    names = [f"{CHANCE}, split {split}" for split in ("test", "val")]
    alone = [table_of("main", run, floors=(CHANCE,)) for run in runs]
    both = table_of("main", *runs, floors=(CHANCE,))
    first, second = (entries(table, "direct", CHANCE, "chance") for table in alone)
    assert first["BinFill"].percent != second["BinFill"].percent
    for level, name in zip((first, second), names, strict=True):
        found = entries(both, "direct", name, "chance")
        assert found["BinFill"].percent == level["BinFill"].percent


def test_only_informative_tables_are_wanted(result) -> None:
    def wanted(*results: list) -> set[str]:
        return {one for one in WHICH if is_informative(one, RunData(frame_of(*results)))}

    two = [*whole(result), *whole(result, "b")]
    assert wanted(whole(result, settings=("explicit", "contextual"))) == {"main"}
    assert wanted(two) == {"main"}
    assert wanted([with_version(two[0], "planner + scripted hands"), *two]) == {"main", "planner"}
    alone = [with_version(one, "planner + scripted hands") for one in whole(result)]
    assert wanted(alone) == {"main"}
    short = whole(result, settings=("contextual",), stages=(1, 5))
    assert wanted(whole(result, settings=("contextual",)), short) == {"main", "context"}
    assert wanted([result(task="PutInBox")]) == {"real"}
    assert wanted([result(task="Outside")]) == {"other"}
    assert wanted([result(arm="silent"), *two]) == {"main"}


NAME = "a_package.with_a_long_name.policies:" + "Net" * 40


@pytest.mark.parametrize(
    ("name", "width", "parts"),
    [
        ("a", 400, 1),
        ("a", 120, 3),
        ("a", 72, 6),
        ("a", 45, 15),
        (NAME, 200, None),
        (NAME, 60, None),
    ],
)
def test_wide_tables_are_drawn_in_parts_with_every_rate_and_name(
    result, name: str, width: int, parts: int | None
) -> None:
    table = table_of("main", whole(result, name))
    texts = []
    for terminal in (True, False):
        console = Console(
            file=io.StringIO(), width=width, force_terminal=terminal, color_system=None
        )
        console.print(renderable(table, console))
        texts.append(console.file.getvalue())
    folded, written = texts
    assert parts in (None, folded.count("Success by task and setting"))
    assert folded.count("50.00") == 2 * len(table.columns)
    # In terminals names are folded; in files lines are as long as they need.
    assert name in re.sub(r"\d+\.\d+|[^\w.:]|explicit|direct", "", folded)
    assert name in written
    assert "…" not in folded + written


def test_csv_has_every_entry_with_its_counts(result) -> None:
    error = [result("error", 2, policy="a", task="BinFill", setting="direct")]
    table = table_of("main", whole(result), error)
    lines = list(csv.DictReader(io.StringIO(get_format("csv").draw(table))))
    assert len(lines) == sum(len(row.entries) for row in table.rows)
    (line,) = [one for one in lines if (one["group"], one["column"]) == ("direct", "BinFill")]
    assert line == {
        "table": "main", "source": "ours", "group": "direct", "name": "a", "column": "BinFill",
        "is_average": "no", "percent": "50.00", "word": "", "applies": "yes", "change": "",
        "best": "no", "incomplete": "errors", "successes": "1", "trials": "2", "episodes": "2",
        "errors": "1", "missing": "0", "low_percent": "9.45", "high_percent": "90.55",
        "comparable": "", "differences": "",
    }  # fmt: skip


def test_tasks_outside_the_paper_have_a_table_of_their_own(result) -> None:
    outside = [
        result(setting=setting, policy="a", task="Outside") for setting in ("explicit", "direct")
    ]
    table = table_of("other", whole(result), outside, published=True)
    assert [column.name for column in table.columns] == ["Outside", "Avg"]
    assert str(entries(table, "direct")["Outside"]) == "100.00 →0.00"
    main = table_of("main", whole(result), outside)
    assert main.rows == table_of("main", whole(result)).rows


def test_results_of_the_twin_are_marked_and_kept_apart_from_a_robots(result) -> None:
    table = table_of(
        "real",
        [result("success", task="PutInBox", privileged=True)],
        [result("failure", task="PutInBox", privileged=True, robot="a robot")],
        published=True,
    )
    ours = {row.name: row.entries[0].text for row in table.rows if row.source == "ours"}
    assert ours == {
        "listener (privileged) (twin)": "100.00",
        "listener, on a robot (privileged)": "0.00",
    }
    assert "(twin): the study's twin, in simulation" in " ".join(table.notes)
