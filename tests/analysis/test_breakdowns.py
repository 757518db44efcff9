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
BY_LABEL = Breakdown("labels", "label", "Made up.")
"""By the column `labels`."""


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

    These turns refer with expressions of their own, such as *it*, which must not become labels. So
    the labels are some of the expressions that were said in all turns, and not all of them.
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


def labeled(results, labels):
    """Return results with a column of labels, of which an episode may have several.

    Args:
        results: of some episodes.
        labels: those of each episode, as in ``[("2 cubes",), ("2 cubes", "red")]``.
    """
    frame = frame_of(results)
    column = [labels[episode] for episode in frame["episode"]]
    return frame.extended({"labels": as_column(column)})


def test_the_gap_of_a_label_is_over_the_episodes_with_that_label():
    """Episodes 0 to 5 have the label "10", 6 has "10" and "9", 7 and 8 have "9". Explicit wins all.

    Direct loses (0) those with "10": a gap of -1, and 7 pairs that differ have p = 2 / 2**7, after
    Holm's correction for two labels twice that. Of those with "9" it loses 6 and wins 7, a gap of
    -1/2 with p = 1; episode 8 ends in an error (!) and counts nowhere. Labels sort as numbers.
    """
    labels = [("10",)] * 6 + [("10", "9")] + [("9",)] * 2
    explicit = make_results("111111111", "explicit")
    direct = make_results("00000001!", "direct")

    nine, ten = break_down(labeled([*explicit, *direct], labels), BY_LABEL)

    assert (ten.key.label, ten.counts.episodes, ten.gap.value) == ("10", 7, -1)
    assert (ten.gap.p_value, ten.p_holm) == pytest.approx((2 / 2**7, 2 * 2 / 2**7))
    assert (nine.key.label, nine.counts.episodes, nine.gap.value) == ("9", 2, -0.5)
    assert (nine.gap.p_value, nine.p_holm) == (1, 1)


def test_without_explicit_results_a_label_has_a_rate_and_no_gap():
    """Of four red episodes in direct one is won (1), two are lost (0), and one is an error (!).

    So 3 episodes have a rate of 1 / 3. Gap, interval and p-value would need explicit episodes:
    would find a gap to episodes that were not played.
    """
    direct = make_results("100!", "direct")

    table = make_breakdown_table(BY_LABEL, labeled(direct, [("red",)] * 4))

    (row,) = table.rows
    assert [entry.text for entry in row.entries] == ["3", "33.33", "–", "–", "–"]
    assert "– without explicit on the same episodes." in table.notes
    assert table.notes[-1].startswith("Incomplete: 1 trial without a verdict")


def test_two_policies_are_compared_on_the_episodes_of_each_label():
    """Episodes 0 to 3 are red, 4 and 5 are red and blue. Policy *better* wins all 6 (1).

    The listener wins 0 and 1: of the red ones 4 of 6 differ, p = 2 / 2**4 in the exact test, and
    of the blue ones 2 of 2, p = 2 / 2**2. Of two tests Holm's correction doubles the smaller one.
    """
    labels = [("red",)] * 4 + [("red", "blue")] * 2
    better = labeled(make_results("111111", "direct", policy="better"), labels)
    listener = labeled(make_results("110000", "direct"), labels)

    found = compare(better, listener, [BY_LABEL])

    blue, red = found.parts["label"]
    assert (red.gap.value, red.p_holm) == pytest.approx((4 / 6, 2 * 2 / 2**4))
    assert (blue.gap.value, blue.p_holm) == pytest.approx((1, 2 / 2**2))
    assert "  direct, red: " in "\n".join(sentences(found, "better", "listener"))


# Commands


def test_compare_prints_the_breakdowns_that_were_asked_for_and_no_other(folder_of_two_policies):
    """Two policies of one run are compared by the pattern of reasoning, and by the rival object."""
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
    """The file has 2,000 records of an episode with a long text, 20 kB each: 40 MB.

    Columns for breakdowns are read from it, among them *slots*, the parts of the goal that the
    instruction hides. Records are read one by one and their long texts dropped, so less than a
    fifth of the file is ever in memory.
    """
    record = replace(records_of_two_policies[1], details="x" * 20_000)
    store(tmp_path, [replace(record, episode=episode) for episode in range(2000)])
    size_of_file = (tmp_path / RECORDS_FILE).stat().st_size
    reads = {name: column.read for name, column in record_columns().items()}

    tracemalloc.start()
    frame = with_columns(frame_of([record]), iterate_records(tmp_path), reads)
    _, most_memory = tracemalloc.get_traced_memory()
    tracemalloc.stop()

    assert frame["slots"].tolist() == [record.metadata["hidden_slots"] or None]
    assert most_memory < size_of_file / 5
