"""Exported instructions: one schema, exact spans, the same bytes."""

import functools
import io
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
    """Four episodes of each task in all settings and forms."""
    episodes = [get_episode(task, "test", index) for task in TASKS for index in range(4)]
    return tuple(row(*said) for said in instructions(episodes, plain_settings(), FORMS))


def test_ids_are_unique_and_say_what_the_row_is(snapshot):
    assert len({line["id"] for line in rows()}) == len(rows())

    episode = get_episode("SwingXtimes", "val", 3)
    wanted = ("contextual", "spatial", "direct-rival", "grounded")
    options = InstructionOptions(stages=(1, 2, 3, 5), distractor="competing", distractors=2)
    assert [row(*said) for said in instructions([episode], wanted, FORMS[:1], options)] == snapshot


def test_spans_count_in_the_whole_prompt():
    for line in rows():
        text = line["text"]
        turns = line["turns"]
        assert " ".join(turn["text"] for turn in turns) == text
        assert (turns[-1]["stage"], turns[-1]["text"]) == ("command", line["command"])
        for turn in turns:
            assert text[turn["start"] :].startswith(turn["text"])
        for mention in line["mentions"]:
            start = mention["start"]
            end = mention["end"]
            assert text[start:end] == mention["text"] != ""
            turn = turns[mention["turn"]]
            assert turn["start"] <= start < end <= turn["start"] + len(turn["text"])


def test_arrow_reads_json_lines_and_parquet_alike():
    pytest.importorskip("pyarrow")
    from pyarrow import json as arrow_json
    from pyarrow import parquet

    data = instruction_export.encode(rows(), "parquet")
    assert data == instruction_export.encode(rows(), "parquet")
    table = parquet.read_table(io.BytesIO(data))
    assert table.to_pylist() == list(rows())
    inferred = arrow_json.read_json(io.BytesIO(instruction_export.encode(rows(), "jsonl")))
    assert inferred.to_pylist() == list(rows())
    assert inferred.schema.names == table.schema.names
    for mine, theirs in zip(table.schema, inferred.schema, strict=True):
        assert mine.type == theirs.type, mine.name


def test_parquet_has_its_types_where_columns_are_empty():
    pytest.importorskip("pyarrow")
    from pyarrow import parquet

    few = [line for line in rows() if line["setting"] == "explicit"]
    schema = parquet.read_schema(io.BytesIO(instruction_export.encode(few, "parquet")))
    assert str(schema.field("landmark_classes").type) == "list<element: int64>"
    assert str(schema.field("pattern").type) == "string"
    assert str(schema.field("episode").type) == "int64"


def test_without_pyarrow_one_sentence_says_what_to_do(monkeypatch):
    monkeypatch.setitem(__import__("sys").modules, "pyarrow", None)
    monkeypatch.setitem(__import__("sys").modules, "pyarrow.parquet", None)
    instruction_export.format_of(Path("rows.jsonl"))

    with pytest.raises(MissingDependencyError, match=r"\[export\]"):
        instruction_export.format_of(Path("rows.parquet"))
