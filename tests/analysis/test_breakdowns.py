"""Gaps by kind of instruction: labels from records, pairing by episode, tables, comparisons."""

from __future__ import annotations

import re
import tracemalloc
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pandas as pd
import pytest
from made_records import make_record
from msgspec.structs import replace
from page_text import call, store

import roboirg
from roboirg.core.errors import InvalidValueError
from roboirg.evaluation.analysis.results.frame import Frame, as_column, make_frame
from roboirg.evaluation.analysis.results.reading import (
    COMPETING,
    NO_RIVAL,
    RIVAL,
    WORD_COLUMNS,
    read_frame,
    with_columns,
)
from roboirg.evaluation.analysis.stats.breakdowns import (
    BREAKDOWNS,
    Breakdown,
    break_down,
)
from roboirg.evaluation.analysis.stats.comparison import compare
from roboirg.evaluation.analysis.stats.comparison_text import sentences
from roboirg.evaluation.analysis.tables.diagnostic_tables import make_breakdown_table
from roboirg.evaluation.plan.plan import Plan
from roboirg.evaluation.plan.sources import Source
from roboirg.evaluation.records.record import Job, Record, Summary
from roboirg.evaluation.records.store import RECORDS_FILE, iterate_records

PLAN = Plan(
    policies=("listener", "forgetful"),
    tasks=("PickXtimes", "VideoUnmask"),
    settings=("explicit", "direct", "reasoning", "contextual"),
    episodes=tuple(range(8)),
)
LETTER = Breakdown("letters", "letter", "Made up.")


def played(job: Job) -> Record:
    """The forgetful policy fails in every implicit instruction that says *it*, and in no other."""
    record = make_record(job, "success")
    says_it = any(one.expression == "it" for one in record.mentions)
    if job.policy == "listener" or not says_it:
        return record
    return replace(record, outcome="failure", cause="it?")


@pytest.fixture(scope="module")
def records() -> tuple[Record, ...]:
    return tuple(played(job) for job in PLAN.jobs())


@pytest.fixture(scope="module")
def run(records: tuple[Record, ...], tmp_path_factory: pytest.TempPathFactory) -> Path:
    return store(tmp_path_factory.mktemp("runs") / "both", records, PLAN).folder


# Labels


def first(records: tuple[Record, ...], setting: str, says: str) -> Record:
    """The first record whose command has a class of expressions."""
    return next(
        one for one in records
        if one.setting == setting and says in WORD_COLUMNS["expression"].read(one)  # type: ignore[operator]
    )  # fmt: skip


@pytest.mark.parametrize(
    ("setting", "says", "metadata", "label"),
    [
        ("direct", "that", {}, None),
        ("direct", "that", {"rival_reference": "contrast"}, "one of two: contrast"),
        ("contextual", "it", {"recency_rival": "the printer"}, RIVAL),
        ("contextual", "it", {"recency_rival": None}, NO_RIVAL),
        ("contextual", "it", {"distractor": "competing"}, COMPETING),
        ("contextual", "that", {"recency_rival": "the printer"}, None),
    ],
)
def test_a_rival_is_what_it_could_mean(
    records: tuple[Record, ...], setting: str, says: str, metadata: dict[str, Any], label: str
) -> None:
    one = first(records, setting, says)
    if says != "it":  # a pronoun in the context is none in the command
        one = replace(one, mentions=tuple(m for m in one.mentions if m.expression != "it"))
    changed = replace(one, metadata={**one.metadata, **metadata})
    assert WORD_COLUMNS["rival"].read(changed) == label


def test_only_the_command_s_expressions_count(records: tuple[Record, ...]) -> None:
    read = WORD_COLUMNS["expression"].read
    contextual = [record for record in records if record.setting == "contextual"]
    found = {label for record in contextual for label in read(record)}  # type: ignore[attr-defined]
    said = {mention.expression for record in contextual for mention in record.mentions}
    assert "them" in said - found, "said of the referents in a reinforcement"
    job = PLAN.jobs()[0].with_options(setting="contextual", form="resolved")
    resolved = make_record(job, "success")
    assert any(mention.expression for mention in resolved.mentions)
    assert read(resolved) == ()


# Numbers


@pytest.mark.parametrize("breakdown", BREAKDOWNS.values(), ids=BREAKDOWNS)
def test_rows_are_what_pandas_gives(run: Path, breakdown: Breakdown) -> None:
    """An episode counts once in each of its labels, and its gap is to itself in explicit."""
    by = ["policy", "setting", "label"]
    whole = roboirg.results(run)
    labeled = whole.assign(label=whole[breakdown.name]).explode("label").dropna(subset="label")
    if not breakdown.in_explicit:
        labeled = labeled[labeled["setting"] != "explicit"]
    text = [f"{one:g}" if breakdown.name == "slots" else str(one) for one in labeled["label"]]
    explicit = whole[whole["setting"] == "explicit"][["policy", "task", "episode", "success"]]
    paired = labeled.assign(label=text, success=labeled["success"].astype(float)).merge(
        explicit.astype({"success": float}), on=["policy", "task", "episode"], suffixes=("", "_0")
    )
    assert len(paired) == len(labeled), "explicit is the reference of every label"
    means = paired.groupby([*by, "task"])[["success", "success_0"]].mean().groupby(by).mean()
    expected = pd.DataFrame(
        {
            "episodes": paired.groupby(by).size(),
            "rate": means["success"],
            "gap": means["success"] - means["success_0"],
        }
    )
    rows = break_down(read_frame([Source(run)], words=True), breakdown)
    found = {
        (one.key.run.policy, one.key.options.setting, one.key.label): (
            one.counts.episodes, float(one.rate or 0), one.gap.value if one.gap else 0.0,
        )
        for one in rows
    }  # fmt: skip
    assert found.keys() == set(expected.index)
    for key, values in found.items():
        assert values == pytest.approx(tuple(expected.loc[key]))


def hand_made(result: Callable[..., Summary], *settings: str) -> Frame:
    """Explicit wins in episodes 0 to 5 of 12, others in 0 to 2; even ones have two labels."""
    results = [
        result("success" if episode < wins else "failure", episode, setting=setting)
        for setting, wins in (("explicit", 6), ("direct", 3))
        if setting in settings
        for episode in range(12)
    ]
    frame = make_frame([("", [*results, result("error", 12, setting="direct")])])
    labels = [("10 b",) if episode % 2 else ("9", "zebra") for episode in frame["episode"]]
    return frame.extended({"letters": as_column(labels)})


def test_gaps_are_those_of_the_very_same_episodes(result: Callable[..., Summary]) -> None:
    """Explicit wins 0, 2, 4 and 1, 3, 5; direct 0, 2 and 1."""
    rows = break_down(hand_made(result, "explicit", "direct"), LETTER)
    assert [(one.key.label, one.counts.episodes) for one in rows] == [
        ("9", 6),
        ("10 b", 6),
        ("zebra", 6),
    ]
    gaps = [one.gap for one in rows]
    assert [gap and round(gap.value * 6) for gap in gaps] == [-1, -2, -1]
    # Of one and of two episodes that differ; both by 3 are more than 1.
    assert [gap and gap.p_value for gap in gaps] == [1.0, 0.5, 1.0]
    assert [one.p_holm for one in rows] == [1.0, 1.0, 1.0]


def test_a_label_without_explicit_has_no_gap(result: Callable[..., Summary]) -> None:
    table = make_breakdown_table(LETTER, hand_made(result, "direct"))
    assert [entry.text for entry in table.rows[0].entries] == ["6", "33.33", "–", "–", "–"]
    assert "– without explicit on the same episodes." in table.notes
    assert table.notes[-1].startswith("Incomplete: 1 trial without a verdict")


def test_a_compared_label_is_the_difference_on_its_episodes(result: Callable[..., Summary]) -> None:
    direct = hand_made(result, "direct")
    better = Frame({
        **direct, "run": as_column([one._replace(policy="better") for one in direct["run"]]),
        "outcome": as_column(["success"] * len(direct["run"])),
    })  # fmt: skip
    found = compare(better, direct, [LETTER])
    parts = found.parts["letter"]
    assert [(part.key.label, round(part.gap.value * 6)) for part in parts] == [
        ("9", 4), ("10 b", 5), ("zebra", 4),
    ]  # fmt: skip
    assert [part.p_holm for part in parts] == pytest.approx(
        [2 * 2 / 2**4, 3 * 2 / 2**5, 2 * 2 / 2**4]
    )
    assert "  direct, 9: " in "\n".join(sentences(found, "better", "listener"))
    nothing = as_column([()] * len(direct["run"]))
    bare = [one.extended({"letters": nothing}) for one in (better, direct)]
    text = list(sentences(compare(*bare, [LETTER]), "better", "listener"))
    assert "By letter: no instruction has one." in text


# Commands


def test_the_wanted_breakdowns_are_compared(run: Path) -> None:
    sides = call("compare", f"{run}:listener", f"{run}:forgetful", "--by", "pattern,rival")
    assert re.findall(r"^By (.*?):", sides, re.MULTILINE) == ["reasoning pattern", "recency rival"]
    assert "  contextual, recency rival: " in sides


def test_explicit_alone_has_nothing_to_break_down(
    records: tuple[Record, ...], tmp_path: Path
) -> None:
    store(tmp_path, [record for record in records if record.setting == "explicit"])
    with pytest.raises(InvalidValueError, match="need an implicit setting"):
        call("tables", tmp_path, "--by", "slots")


# Memory


def test_words_are_read_line_by_line(records: tuple[Record, ...], tmp_path: Path) -> None:
    """The long parts of records are dropped at once: labels take a small share of the file."""
    long = replace(records[1], details="x" * 20_000)
    store(tmp_path, [replace(long, episode=episode) for episode in range(2000)])
    reads = {name: column.read for name, column in WORD_COLUMNS.items()}
    tracemalloc.start()
    frame = with_columns(make_frame([("", [long])]), iterate_records(tmp_path), reads)
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert frame["slots"].tolist() == [long.metadata["hidden_slots"] or None]
    assert peak < (tmp_path / RECORDS_FILE).stat().st_size / 5
