"""`roboirg language ...` and `roboirg export ...`."""

import csv
import json

import pytest
import rate_words
from page_text import call
from plan_files import plan_file
from typer.testing import CliRunner

from roboirg import main as cli
from roboirg.core.errors import InvalidValueError, RoboIRGError, UnknownNameError

WORDINGS = """name = "test"
tasks = ["StopCube"]
[commands]
all = ["Press the button when the cube reaches the target {visit}."]
"""


@pytest.mark.usefixtures("in_this_process")
def test_instructions_in_words_from_outside(tmp_path):
    file, out = tmp_path / "test.toml", tmp_path / "rows.jsonl"
    file.write_text(WORDINGS)
    assert "Press the button when" in call("show", "StopCube", "0", "--words", "--wordings", file)
    words = plan_file(wordings=str(file), forms="implicit")
    call("export", "instructions", "--out", out, "--plan", words)
    rows = [json.loads(line) for line in out.read_text().splitlines()]
    assert {row["task"] for row in rows} == {"StopCube"}  # all of the file
    assert {row["wordings"].partition("@")[0] for row in rows} == {"test"}
    assert {row["whole_sentence"] for row in rows} == {"own"}
    with pytest.raises(InvalidValueError, match="has no words of BinFill"):
        call("show", "BinFill", "0", "--words", "--wordings", file)


def test_the_same_bytes_every_time_and_only_what_is_asked_for(tmp_path):
    files = [tmp_path / "one.jsonl", tmp_path / "two.jsonl"]
    plan = plan_file(stages=[1, 2, 3, 5], distractor="competing", frame="camera", forms="implicit")
    words = ("--tasks", "ButtonUnmask,StopCube", "--split", "val", "--plan", plan)
    for file in files:
        settings = ("--settings", "spatial,direct,contextual")
        call("export", "instructions", "--out", file, *words, *settings)
    assert files[0].read_bytes() == files[1].read_bytes()
    assert sorted(tmp_path.iterdir()) == files
    rows = [json.loads(line) for line in files[0].read_text().splitlines()]
    said = {(row["task"], row["setting"]) for row in rows}
    assert len(said) == 5
    assert ("StopCube", "spatial") not in said
    assert {row["split"] for row in rows} == {"val"}
    assert {row["frame"] for row in rows} == {None, "camera"}
    contextual = next(row for row in rows if row["setting"] == "contextual")
    assert [turn["stage"] for turn in contextual["turns"]][1:3] == ["reinforcement", "distractor"]
    assert contextual["distractor"] == "competing"


@pytest.mark.parametrize(
    ("out", "words", "kind", "sentence"),
    [
        ("o.jsonl", ("--settings", "spatail"), UnknownNameError, "Did you mean 'spatial'"),
        ("o.jsonl", ("--plan", plan_file(stages="2,5")), InvalidValueError, "must be one of"),
        ("o.jsonl", ("--tasks", "StopCube", "--settings", "spatial"), InvalidValueError, "None of"),
        ("o.csv", (), UnknownNameError, "There is no format 'csv'"),
        ("", (), InvalidValueError, "is not a file in an existing folder"),
        ("nowhere/o.jsonl", (), InvalidValueError, "is not a file in an existing folder"),
    ],
)
def test_what_is_wrong_is_one_sentence(tmp_path, out, words, kind, sentence):
    with pytest.raises(kind, match=sentence):
        call("export", "instructions", "--out", tmp_path / out, *words)
    assert not list(tmp_path.iterdir())


def test_stats_print_tables(monkeypatch, snapshot):
    monkeypatch.setenv("COLUMNS", "150")
    printed = call("language", "stats", "--tasks", "VideoPlaceButton,VideoUnmask,PickXtimes")
    assert printed == snapshot


def test_stats_of_all_splits_leave_out_empty_tables():
    printed = call("language", "stats", "--split", "all", "--tasks", "StopCube")
    assert "Relations" in printed
    assert "Landmark" not in printed


@pytest.mark.usefixtures("in_this_process")
def test_an_author_sees_texts_and_the_broken_rule_in_each_task(tmp_path, snapshot):
    file = tmp_path / "mine.toml"
    file.write_text(
        'tasks = ["PickXtimes", "SwingXtimes"]\n'
        '[[scenario]]\nframe = "far"\npool = "train"\nsetting = "spatial"\n'
        'introduction = "Look at the cube {place}."\n'
        'say.color = ["the cube <there place: there>"]\n'
    )
    words = ["language", "check-scenarios", str(file), "--seeds", "0"]
    result = CliRunner().invoke(cli.app, words)
    assert isinstance(result.exception, RoboIRGError)
    assert f"{result.stdout}{result.exception}" == snapshot
    result = CliRunner().invoke(cli.app, [*words, "--scenario", "fear"])
    assert str(result.exception) == "There is no scenario 'fear'; known: far. Did you mean 'far'?"


@pytest.mark.usefixtures("in_this_process")
def test_raters_get_the_texts_of_the_key_in_other_orders_and_their_table(tmp_path):
    out, tasks = tmp_path / "rating", "PickXtimes,SwingXtimes"  # which share frames
    settings = ("--settings", "direct,reasoning")
    call("language", "sample", "--out", out, "--tasks", tasks, *settings)
    read = [list(csv.reader(path.open())) for path in sorted(out.glob("sheet-*.csv"))]
    key = list(csv.DictReader((out / "key.csv").open()))
    for rows in read:
        assert {row[0]: row[1] for row in rows[1:]} == {row["number"]: row["text"] for row in key}
    assert len({tuple(row[0] for row in rows) for rows in read}) == len(read) == 3
    frames = {(row["setting"], row["frame"]) for row in key}
    assert len(frames) == len(key)
    by_number = {row["number"]: row for row in key}
    ratings = dict.fromkeys(by_number, 4.0)
    for _, _, rated, interval, _ in rate_words.rows(by_number, [ratings, ratings]):
        low, high = interval.split(" to ")
        assert rated == "4.0"
        assert float(low) < 4.0 < float(high), "frames that are all alike leave room for others"
    with pytest.raises(SystemExit, match=r"rates text \d+ ''; it must be a number"):
        rate_words.read_ratings(out / "sheet-1.csv", by_number)
