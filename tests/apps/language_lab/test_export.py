"""Exported instructions: one schema, exact spans, the same bytes."""

import functools
import io
import sys
from pathlib import Path

import pytest
from language_variants import TASKS

from roboirg.apps.language_lab import instruction_export
from roboirg.core.errors import MissingDependencyError
from roboirg.core.instruction_options import InstructionOptions
from roboirg.language import FORMS, plain_settings
from roboirg.language.instruction_row import row
from roboirg.language.variants import instructions
from roboirg.tasks.splits.splits import get_episode


@functools.cache
def rows():
    """Return the exported rows of four episodes of each task in all settings and forms."""
    episodes = [get_episode(task, "test", index) for task in TASKS for index in range(4)]
    return tuple(row(*said) for said in instructions(episodes, plain_settings(), FORMS))


def test_the_ids_of_exported_rows_are_unique():
    """An id is such as `SwingXtimes/val/3/contextual/implicit`."""
    ids = [line["id"] for line in rows()]
    assert len(set(ids)) == len(ids)


def test_ids_are_unique_and_say_what_the_row_is(snapshot):
    """All fields of four rows, with ids such as `SwingXtimes/val/3/spatial/implicit`."""
    episode = get_episode("SwingXtimes", "val", 3)
    wanted = ("contextual", "spatial", "direct-rival", "grounded")
    options = InstructionOptions(stages=(1, 2, 3, 5), distractor="competing", distractors=2)
    assert [row(*said) for said in instructions([episode], wanted, FORMS[:1], options)] == snapshot


def test_the_turns_of_an_exported_row_are_its_text_and_end_with_the_command():
    """Turns are what is said one after the other; the text joins them by spaces."""
    for line in rows():
        turns = [turn["text"] for turn in line["turns"]]
        assert " ".join(turns) == line["text"]
        assert turns[-1] == line["command"]


def test_the_start_of_a_turn_counts_in_the_whole_text():
    """Spans of turns and of mentions count characters from the same place."""
    for line in rows():
        for turn in line["turns"]:
            assert line["text"][turn["start"] :].startswith(turn["text"])


def test_spans_count_in_the_whole_prompt():
    """A mention is the span of a text that stands for a value of the goal; it lies in its turn."""
    for line in rows():
        for mention in line["mentions"]:
            start = mention["start"]
            end = mention["end"]
            turn = line["turns"][mention["turn"]]
            assert line["text"][start:end] == mention["text"] != ""
            assert turn["start"] <= start < end <= turn["start"] + len(turn["text"])


def read_parquet(data):
    """Return a table of parquet data; skip the test without pyarrow."""
    return pytest.importorskip("pyarrow.parquet").read_table(io.BytesIO(data))


def test_two_exports_to_parquet_have_the_same_bytes():
    """So that a dataset can be compared by its hash."""
    pytest.importorskip("pyarrow")
    first = instruction_export.encode(rows(), "parquet")
    assert instruction_export.encode(rows(), "parquet") == first


def test_arrow_reads_json_lines_and_parquet_alike():
    """The same rows, in columns of the same names and types."""
    arrow_json = pytest.importorskip("pyarrow.json")
    parquet = read_parquet(instruction_export.encode(rows(), "parquet"))

    lines = arrow_json.read_json(io.BytesIO(instruction_export.encode(rows(), "jsonl")))

    assert lines.to_pylist() == parquet.to_pylist() == list(rows())
    assert lines.schema.names == parquet.schema.names
    assert lines.schema.types == parquet.schema.types


@pytest.mark.parametrize(
    ("column", "kind"),
    [("landmark_classes", "list<element: int64>"), ("pattern", "string"), ("episode", "int64")],
)
def test_parquet_has_its_types_where_columns_are_empty(column, kind):
    """Explicit instructions have neither landmarks nor a pattern."""
    few = [line for line in rows() if line["setting"] == "explicit"]
    schema = read_parquet(instruction_export.encode(few, "parquet")).schema
    assert str(schema.field(column).type) == kind


@pytest.fixture
def without_pyarrow(monkeypatch):
    """As if pyarrow were not installed."""
    monkeypatch.setitem(sys.modules, "pyarrow", None)
    monkeypatch.setitem(sys.modules, "pyarrow.parquet", None)


@pytest.mark.usefixtures("without_pyarrow")
def test_json_lines_need_no_pyarrow():
    """Only Parquet needs it."""
    assert instruction_export.format_of(Path("rows.jsonl")) == "jsonl"


@pytest.mark.usefixtures("without_pyarrow")
def test_without_pyarrow_one_sentence_says_what_to_do():
    """`pip install "roboirgbench[export]"` brings it."""
    with pytest.raises(MissingDependencyError, match=r"\[export\]"):
        instruction_export.format_of(Path("rows.parquet"))
