"""Exported instructions: one schema, exact spans, the same bytes."""

import functools
import io
import json

import pytest
from language_variants import TASKS

from roboirg.apps.language_lab import instruction_export
from roboirg.core.errors import MissingDependencyError
from roboirg.core.instruction_options import InstructionOptions
from roboirg.language import FORMS, plain_settings
from roboirg.language.instruction_row import row
from roboirg.language.variants import instructions
from roboirg.tasks.splits.splits import get_episode

LISTS = {
    "patterns": str,
    "references": str,
    "landmarks": str,
    "templates": str,
    "landmark_classes": int,
    "stages": int,
}


@functools.cache
def rows():
    """Four episodes of each task in all settings and forms."""
    episodes = [get_episode(task, "test", index) for task in TASKS for index in range(4)]
    return tuple(row(*one) for one in instructions(episodes, plain_settings(), FORMS))


def test_every_row_has_the_same_columns_and_types():
    columns = list(rows()[0])
    kinds: dict[str, set[type]] = {}
    for one in rows():
        assert list(one) == columns
        for name, value in one.items():
            kinds.setdefault(name, set()).add(type(value))
            assert name not in LISTS or all(type(item) is LISTS[name] for item in value)
        for nested in ("turns", "mentions"):
            assert len({tuple(item) for item in one[nested]}) <= 1
    for name, found in kinds.items():
        assert len(found - {type(None)}) == 1, name


def test_ids_are_unique_and_say_what_the_row_is(snapshot):
    assert len({one["id"] for one in rows()}) == len(rows())
    episode = get_episode("SwingXtimes", "val", 3)
    wanted = ("contextual", "spatial", "direct-rival", "grounded")
    options = InstructionOptions(stages=(1, 2, 3, 5), distractor="competing", distractors=2)
    assert [row(*one) for one in instructions([episode], wanted, FORMS[:1], options)] == snapshot


def test_spans_count_in_the_whole_prompt():
    for one in rows():
        for turn in one["turns"]:
            assert one["text"][turn["start"] :].startswith(turn["text"])
        assert " ".join(turn["text"] for turn in one["turns"]) == one["text"]
        assert one["turns"][-1] == {
            "stage": "command",
            "start": len(one["text"]) - len(one["command"]),
            "text": one["command"],
        }
        for mention in one["mentions"]:
            assert one["text"][mention["start"] : mention["end"]] == mention["text"]
            turn = one["turns"][mention["turn"]]
            assert turn["start"] <= mention["start"] < mention["end"]
            assert mention["end"] <= turn["start"] + len(turn["text"])


def test_goals_are_the_episodes():
    for one in rows():
        goal = get_episode(one["task"], one["split"], one["episode"]).goal
        expected = {
            slot: list(value) if isinstance(value, tuple) else value for slot, value in goal.slots
        }
        assert json.loads(one["goal"]) == expected


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


@pytest.mark.parametrize("settings", [plain_settings(), ("explicit",)])
def test_parquet_has_its_types_whatever_is_in_it(settings):
    pytest.importorskip("pyarrow")
    from pyarrow import parquet

    few = [one for one in rows() if one["setting"] in settings]
    schema = parquet.read_schema(io.BytesIO(instruction_export.encode(few, "parquet")))
    assert str(schema.field("landmark_classes").type) == "list<element: int64>"
    assert str(schema.field("pattern").type) == "string"
    assert str(schema.field("episode").type) == "int64"


def test_without_pyarrow_one_sentence_says_what_to_do(monkeypatch):
    monkeypatch.setitem(__import__("sys").modules, "pyarrow", None)
    monkeypatch.setitem(__import__("sys").modules, "pyarrow.parquet", None)
    instruction_export.check_export_support("jsonl")
    with pytest.raises(MissingDependencyError, match=r"\[export\]"):
        instruction_export.check_export_support("parquet")
