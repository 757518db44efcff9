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
BY_LETTERS = Breakdown("letters", "letter", "Made up.")


def record_of_job(job: Job) -> Record:
    """The forgetful policy fails in every implicit instruction that says *it*, and in no other."""
    record = make_record(job, "success")
    says_it = any(mention.expression == "it" for mention in record.mentions)
    if job.policy == "listener" or not says_it:
        return record
    return replace(record, outcome="failure", cause="it?")


@pytest.fixture(scope="module")
def records_of_two_policies() -> Records:
    return tuple(record_of_job(job) for job in PLAN.jobs())


@pytest.fixture(scope="module")
def folder_of_two_policies(
    records_of_two_policies: Records, tmp_path_factory: pytest.TempPathFactory
) -> Path:
    return store(tmp_path_factory.mktemp("runs") / "both", records_of_two_policies, PLAN).folder


# Labels


def test_a_rival_is_labeled_with_the_words_that_single_it_out(records_of_two_policies):
    read = record_columns()["rival"].read
    for record in records_of_two_policies:
        reference = record.metadata["rival_reference"]
        assert (reference is not None) == (record.setting == "direct-rival")
        assert read(record) == (f"one of two: {reference}" if reference else None)


def test_an_episode_is_labeled_with_the_expressions_of_its_command_alone(records_of_two_policies):
    read = record_columns()["expression"].read
    contextual = [record for record in records_of_two_policies if record.setting == "contextual"]
    found = {label for record in contextual for label in read(record)}  # type: ignore[attr-defined]
    said = {mention.expression for record in contextual for mention in record.mentions}

    assert found < said, "a reinforcement has others"

    job = PLAN.jobs()[0].with_options(setting="contextual", form="resolved")
    resolved = make_record(job, "success")
    assert read(resolved) == ()


# Numbers


def explicit_wins_6_of_12_and_direct_3(*settings: str) -> Frame:
    """Return the results of these settings. Direct has one more episode, an error.

    Even episodes have the labels "9" and "zebra", odd ones "10 b".
    """
    results = [*make_results("1" * 6 + "0" * 6), *make_results("1" * 3 + "0" * 9 + "!", "direct")]
    frame = frame_of([result for result in results if result.setting in settings])
    labels = [("10 b",) if episode % 2 else ("9", "zebra") for episode in frame["episode"]]
    return frame.extended({"letters": as_column(labels)})


def test_the_gap_of_a_label_is_over_the_episodes_with_that_label():
    """Of the even episodes ("9", "zebra") explicit wins 0, 2, 4 and direct 0, 2: a gap of -1 of 6.

    Of the odd ones ("10 b") explicit wins 1, 3, 5 and direct 1: -2 of 6.
    """
    rows = break_down(explicit_wins_6_of_12_and_direct_3("explicit", "direct"), BY_LETTERS)
    assert [(row.key.label, row.counts.episodes) for row in rows] == [
        ("9", 6),
        ("10 b", 6),
        ("zebra", 6),
    ]

    gaps = [row.gap for row in rows]
    assert [gap and round(gap.value * 6) for gap in gaps] == [-1, -2, -1]
    # Tests of 1 and of 2 episodes that differ; corrected for 3 tests, all reach the most, 1.
    assert [gap and gap.p_value for gap in gaps] == [1.0, 0.5, 1.0]
    assert [row.p_holm for row in rows] == [1.0, 1.0, 1.0]


def test_without_explicit_results_a_label_has_a_rate_and_no_gap():
    """2 of 6 are won; would find a gap to episodes that were not played."""
    table = make_breakdown_table(BY_LETTERS, explicit_wins_6_of_12_and_direct_3("direct"))
    assert [entry.text for entry in table.rows[0].entries] == ["6", "33.33", "–", "–", "–"]
    assert "– without explicit on the same episodes." in table.notes
    assert table.notes[-1].startswith("Incomplete: 1 trial without a verdict")


def test_two_policies_are_compared_on_the_episodes_of_each_label():
    """The better one wins all 12, so it gains 4 of 6, 5 of 6 and again 4 of 6 episodes."""
    direct = explicit_wins_6_of_12_and_direct_3("direct")
    better = Frame({
        **direct, "run": as_column([result._replace(policy="better") for result in direct["run"]]),
        "outcome": as_column(["success"] * len(direct["run"])),
    })  # fmt: skip
    found = compare(better, direct, [BY_LETTERS])

    parts = found.parts["letter"]

    assert [(part.key.label, round(part.gap.value * 6)) for part in parts] == [
        ("9", 4), ("10 b", 5), ("zebra", 4),
    ]  # fmt: skip
    # All n episodes that differ do so to one side, 2 / 2^n; Holm: the rarest times 3, others 2.
    assert [part.p_holm for part in parts] == pytest.approx(
        [2 * 2 / 2**4, 3 * 2 / 2**5, 2 * 2 / 2**4]
    )
    assert "  direct, 9: " in "\n".join(sentences(found, "better", "listener"))


# Commands


def test_compare_prints_the_breakdowns_that_were_asked_for_and_no_other(folder_of_two_policies):
    sides = call(
        "compare",
        f"{folder_of_two_policies}:listener",
        f"{folder_of_two_policies}:forgetful",
        "--by",
        "pattern,rival",
    )
    assert re.findall(r"^By (.*?):", sides, re.MULTILINE) == ["reasoning pattern", "rival"]
    assert "  direct-rival, one of two: " in sides


def test_results_of_explicit_instructions_alone_cannot_be_broken_down(
    records_of_two_policies, tmp_path
):
    store(tmp_path, [record for record in records_of_two_policies if record.setting == "explicit"])
    with pytest.raises(InvalidValueError, match="need an implicit setting"):
        call("tables", tmp_path, "--by", "slots")


# Memory


def test_breakdowns_read_a_file_of_records_without_holding_it_in_memory(
    records_of_two_policies, tmp_path
):
    """Of 2,000 records of 20 kB less than a fifth is ever in memory: long parts are dropped."""
    long = replace(records_of_two_policies[1], details="x" * 20_000)
    store(tmp_path, [replace(long, episode=episode) for episode in range(2000)])
    reads = {name: column.read for name, column in record_columns().items()}

    tracemalloc.start()
    frame = with_columns(frame_of([long]), iterate_records(tmp_path), reads)
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()

    assert frame["slots"].tolist() == [long.metadata["hidden_slots"] or None]
    assert peak < (tmp_path / RECORDS_FILE).stat().st_size / 5
