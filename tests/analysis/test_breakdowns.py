"""Gaps by kind of instruction: labels from records, pairing by episode, tables, comparisons."""

from __future__ import annotations

import re
import tracemalloc

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
from roboirg.analysis.results.frame import as_column
from roboirg.analysis.results.reading import (
    record_columns,
    with_columns,
)
from roboirg.analysis.tables.diagnostic_tables import make_breakdown_table
from roboirg.core.errors import InvalidValueError
from roboirg.records.record import Record
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


def record_of_job(job):
    """The forgetful policy fails in every implicit instruction that says *it*, and in no other."""
    record = make_record(job, "success")
    says_it = any(mention.expression == "it" for mention in record.mentions)
    if job.policy == "listener" or not says_it:
        return record
    return replace(record, outcome="failure", cause="it?")


@pytest.fixture(scope="module")
def records_of_two_policies():
    return tuple(record_of_job(job) for job in PLAN.jobs())


@pytest.fixture(scope="module")
def folder_of_two_policies(records_of_two_policies, tmp_path_factory):
    return store(tmp_path_factory.mktemp("runs") / "both", records_of_two_policies, PLAN).folder


# Labels


def test_a_rival_is_labeled_with_the_words_that_single_it_out(records_of_two_policies):
    """A rival is a second thing that fits: of *the cube*, the label may be "one of two: left".

    Only the setting direct-rival has one; elsewhere the label is None.
    """
    read_label = record_columns()["rival"].read

    for record in records_of_two_policies:
        label = read_label(record)
        if record.setting == "direct-rival":
            assert label == f"one of two: {record.metadata['rival_reference']}"
        else:
            assert label is None, record.slug


def test_an_episode_is_labeled_with_the_expressions_of_its_command_alone(records_of_two_policies):
    """A contextual instruction also has turns before the command, such as a reinforcement.

    These turns refer with expressions of their own, which must not become labels.
    """
    read = record_columns()["expression"].read
    labels = set()
    said = set()

    for record in records_of_two_policies:
        if record.setting == "contextual":
            labels.update(read(record))
            said.update(mention.expression for mention in record.mentions)

    assert labels < said


def test_an_instruction_with_references_spelled_out_has_no_expression():
    job = PLAN.jobs()[0].with_options(setting="contextual", form="resolved")

    assert record_columns()["expression"].read(make_record(job, "success")) == ()


# Numbers


def labeled_by_letters(results):
    """Return results of which even episodes have the labels "9" and "zebra", odd ones "10 b"."""
    frame = frame_of(results)
    labels = [("10 b",) if episode % 2 else ("9", "zebra") for episode in frame["episode"]]
    return frame.extended({"letters": as_column(labels)})


def test_the_gap_of_a_label_is_over_the_episodes_with_that_label():
    """A letter is an episode: 1 won, 0 lost, ! an error, which counts nowhere.

    Even episodes have the labels "9" and "zebra": explicit wins 0, 2, 4 and direct 0, 2, a gap of
    -1 of 6. Odd ones have "10 b": explicit wins 1, 3, 5 and direct 1, -2 of 6.
    """
    explicit = make_results("111111000000")
    direct = make_results("111000000000!", "direct")

    rows = break_down(labeled_by_letters([*explicit, *direct]), BY_LETTERS)

    found = []
    for row in rows:
        gap = row.gap
        assert gap is not None
        found.append((row.key.label, row.counts.episodes, round(gap.value * 6), gap.p_value))
    # Tests of 1 and of 2 episodes that differ; corrected for 3 tests, all reach the most, 1.
    assert found == [("9", 6, -1, 1.0), ("10 b", 6, -2, 0.5), ("zebra", 6, -1, 1.0)]
    assert [row.p_holm for row in rows] == [1.0, 1.0, 1.0]


def test_without_explicit_results_a_label_has_a_rate_and_no_gap():
    """Of the six even episodes two are won; would find a gap to episodes that were not played."""
    direct = make_results("111000000000!", "direct")

    table = make_breakdown_table(BY_LETTERS, labeled_by_letters(direct))

    assert [entry.text for entry in table.rows[0].entries] == ["6", "33.33", "–", "–", "–"]
    assert "– without explicit on the same episodes." in table.notes
    assert table.notes[-1].startswith("Incomplete: 1 trial without a verdict")


def test_two_policies_are_compared_on_the_episodes_of_each_label():
    """Even episodes have the labels "9" and "zebra", odd ones "10 b".

    The better policy wins all 12, so it gains 4 of 6, 5 of 6 and again 4 of 6 episodes.
    """
    better = labeled_by_letters(make_results("1" * 12, "direct", policy="better"))
    direct = labeled_by_letters(make_results("111000000000", "direct"))

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
