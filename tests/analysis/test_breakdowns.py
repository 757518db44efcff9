"""Gaps by kind of instruction: labels from records, pairing by episode, tables, comparisons."""

from __future__ import annotations

import re
import tracemalloc
from pathlib import Path

import pytest
from flat_jobs import frame_of, make_results
from made_records import make_record
from msgspec.structs import replace
from page_text import call, store

from roboirg.analysis.measures.breakdowns import (
    Breakdown,
    break_down,
)
from roboirg.analysis.measures.comparison import compare
from roboirg.analysis.measures.comparison_text import sentences
from roboirg.analysis.results.frame import Frame, as_column
from roboirg.analysis.results.reading import (
    record_columns,
    with_columns,
)
from roboirg.analysis.tables.diagnostic_tables import make_breakdown_table
from roboirg.core.errors import InvalidValueError
from roboirg.records.record import Job, Record
from roboirg.records.store import RECORDS_FILE, iterate_records
from roboirg.runs.plan.plan import Plan

Records = tuple[Record, ...]
PLAN = Plan(
    policies=("listener", "forgetful"),
    tasks=("PickXtimes", "VideoUnmask"),
    settings=("explicit", "direct", "reasoning", "contextual", "direct-rival"),
    episodes=tuple(range(8)),
)
LETTER = Breakdown("letters", "letter", "Made up.")


def played(job: Job) -> Record:
    """The forgetful policy fails in every implicit instruction that says *it*, and in no other."""
    record = make_record(job, "success")
    says_it = any(mention.expression == "it" for mention in record.mentions)
    if job.policy == "listener" or not says_it:
        return record
    return replace(record, outcome="failure", cause="it?")


@pytest.fixture(scope="module")
def records() -> Records:
    return tuple(played(job) for job in PLAN.jobs())


@pytest.fixture(scope="module")
def run(records: Records, tmp_path_factory: pytest.TempPathFactory) -> Path:
    return store(tmp_path_factory.mktemp("runs") / "both", records, PLAN).folder


# Labels


def test_a_rival_has_the_kind_of_words_that_single_it_out(records):
    read = record_columns()["rival"].read
    for record in records:
        reference = record.metadata["rival_reference"]
        assert (reference is not None) == (record.setting == "direct-rival")
        assert read(record) == (f"one of two: {reference}" if reference else None)


def test_only_the_command_s_expressions_count(records):
    read = record_columns()["expression"].read
    contextual = [record for record in records if record.setting == "contextual"]
    found = {label for record in contextual for label in read(record)}  # type: ignore[attr-defined]
    said = {mention.expression for record in contextual for mention in record.mentions}

    assert found < said, "a reinforcement has others"

    job = PLAN.jobs()[0].with_options(setting="contextual", form="resolved")
    resolved = make_record(job, "success")
    assert read(resolved) == ()


# Numbers


def hand_made(*settings: str) -> Frame:
    """Explicit wins in episodes 0 to 5 of 12, others in 0 to 2; even ones have two labels."""
    results = [*make_results("1" * 6 + "0" * 6), *make_results("1" * 3 + "0" * 9 + "!", "direct")]
    frame = frame_of([result for result in results if result.setting in settings])
    labels = [("10 b",) if episode % 2 else ("9", "zebra") for episode in frame["episode"]]
    return frame.extended({"letters": as_column(labels)})


def test_gaps_are_those_of_the_very_same_episodes():
    """Explicit wins 0, 2, 4 and 1, 3, 5; direct 0, 2 and 1."""
    rows = break_down(hand_made("explicit", "direct"), LETTER)
    assert [(row.key.label, row.counts.episodes) for row in rows] == [
        ("9", 6),
        ("10 b", 6),
        ("zebra", 6),
    ]

    gaps = [row.gap for row in rows]
    assert [gap and round(gap.value * 6) for gap in gaps] == [-1, -2, -1]
    # Of one and of two episodes that differ; both by 3 are more than 1.
    assert [gap and gap.p_value for gap in gaps] == [1.0, 0.5, 1.0]
    assert [row.p_holm for row in rows] == [1.0, 1.0, 1.0]


def test_a_label_without_explicit_has_no_gap():
    table = make_breakdown_table(LETTER, hand_made("direct"))
    assert [entry.text for entry in table.rows[0].entries] == ["6", "33.33", "–", "–", "–"]
    assert "– without explicit on the same episodes." in table.notes
    assert table.notes[-1].startswith("Incomplete: 1 trial without a verdict")


def test_a_compared_label_is_the_difference_on_its_episodes():
    direct = hand_made("direct")
    better = Frame({
        **direct, "run": as_column([result._replace(policy="better") for result in direct["run"]]),
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


# Commands


def test_the_wanted_breakdowns_are_compared(run):
    sides = call("compare", f"{run}:listener", f"{run}:forgetful", "--by", "pattern,rival")
    assert re.findall(r"^By (.*?):", sides, re.MULTILINE) == ["reasoning pattern", "rival"]
    assert "  direct-rival, one of two: " in sides


def test_explicit_alone_has_nothing_to_break_down(records, tmp_path):
    store(tmp_path, [record for record in records if record.setting == "explicit"])
    with pytest.raises(InvalidValueError, match="need an implicit setting"):
        call("tables", tmp_path, "--by", "slots")


# Memory


def test_words_are_read_line_by_line(records, tmp_path):
    """The long parts of records are dropped at once: labels take a small share of the file."""
    long = replace(records[1], details="x" * 20_000)
    store(tmp_path, [replace(long, episode=episode) for episode in range(2000)])
    reads = {name: column.read for name, column in record_columns().items()}

    tracemalloc.start()
    frame = with_columns(frame_of([long]), iterate_records(tmp_path), reads)
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()

    assert frame["slots"].tolist() == [long.metadata["hidden_slots"] or None]
    assert peak < (tmp_path / RECORDS_FILE).stat().st_size / 5
