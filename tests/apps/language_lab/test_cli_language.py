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
    file = tmp_path / "test.toml"
    out = tmp_path / "rows.jsonl"
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
    settings = ("--settings", "all")

    for file in files:
        call("export", "instructions", "--out", file, *words, *settings)

    assert files[0].read_bytes() == files[1].read_bytes()
    assert sorted(tmp_path.iterdir()) == files

    rows = [json.loads(line) for line in files[0].read_text().splitlines()]
    said = {(row["task"], row["setting"]) for row in rows}
    assert ("ButtonUnmask", "spatial") in said
    assert ("StopCube", "spatial") not in said  # which all may lack
    assert {row["split"] for row in rows} == {"val"}
    assert {row["frame"] for row in rows} == {None, "camera"}

    contextual = next(row for row in rows if row["setting"] == "contextual")
    stages = [turn["stage"] for turn in contextual["turns"]]
    assert stages[1:3] == ["reinforcement", "distractor"]
    assert contextual["distractor"] == "competing"


@pytest.mark.parametrize(
    ("out", "words", "kind", "sentence"),
    [
        ("o.jsonl", ("--settings", "spatail"), UnknownNameError, "Did you mean 'spatial'"),
        ("o.jsonl", ("--plan", plan_file(stages="2,5")), InvalidValueError, "must be one of"),
        ("o.jsonl", ("--tasks", "StopCube", "--settings", "spatial"), InvalidValueError, "no spat"),
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


@pytest.fixture
def rating(tmp_path, in_this_process):
    """A folder with sheets for raters, of two tasks that share frames."""
    out = tmp_path / "rating"
    settings = ("--settings", "direct,reasoning")
    call("language", "sample", "--out", out, "--tasks", "PickXtimes,SwingXtimes", *settings)
    return out


def read_key(rating):
    """Return the rows of the key by their numbers."""
    with (rating / "key.csv").open() as file:
        return {row["number"]: row for row in csv.DictReader(file)}


def test_raters_get_the_texts_of_the_key_in_other_orders(rating):
    key = read_key(rating)
    frames = {(row["setting"], row["frame"]) for row in key.values()}
    assert len(frames) == len(key)

    orders = set()
    for path in rating.glob("sheet-*.csv"):
        _, *rows = csv.reader(path.open())
        assert {row[0]: row[1] for row in rows} == {name: row["text"] for name, row in key.items()}
        orders.add(tuple(row[0] for row in rows))
    assert len(orders) == len(list(rating.glob("sheet-*.csv"))) == 3


def test_raters_table_has_intervals_around_equal_ratings(rating):
    key = read_key(rating)
    ratings = dict.fromkeys(key, 4.0)

    for _, _, rated, interval, _ in rate_words.rows(key, [ratings, ratings]):
        low, high = interval.split(" to ")
        assert rated == "4.0"
        assert float(low) < 4.0 < float(high), "frames that are all alike leave room for others"


def test_an_empty_rating_is_refused_with_its_number(rating):
    with pytest.raises(SystemExit, match=r"rates text \d+ ''; it must be a number"):
        rate_words.read_ratings(rating / "sheet-1.csv", read_key(rating))
