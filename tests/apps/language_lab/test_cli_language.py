"""The commands `roboirg language …` and `roboirg export instructions`."""

import csv
import json

import pandas as pd
import pytest
import rate_words
from page_text import call
from plan_files import plan_file
from typer.testing import CliRunner

from roboirg import main as cli
from roboirg.core.errors import InvalidValueError, RoboIRGError, UnknownNameError


@pytest.fixture
def stopcube_wordings(tmp_path):
    """A user's file of words that has one command, for StopCube."""
    file = tmp_path / "test.toml"
    file.write_text(
        'name = "test"\ntasks = ["StopCube"]\n[commands]\n'
        'all = ["Press the button when the cube reaches the target {visit}."]\n'
    )
    return file


def exported_rows(out, *options):
    """Return what `export instructions` writes to a file of JSON lines."""
    call("export", "instructions", "--out", out, *options)
    return [json.loads(line) for line in out.read_text().splitlines()]


def test_show_prints_the_words_of_a_user_s_file(stopcube_wordings):
    """The file has this one command."""
    printed = call("show", "StopCube", "0", "--words", "--wordings", stopcube_wordings)
    assert "Press the button when the cube reaches the target" in printed


@pytest.mark.usefixtures("in_this_process")
def test_exported_instructions_in_words_of_a_user_s_file_are_those_of_its_tasks(
    stopcube_wordings, tmp_path
):
    """The file of the fixture is named "test" and has one command, for StopCube alone, so that the
    export has no other task, although the command names none.

    *Own* says that the words are put together by our grammar, not taken from RoboMME as whole
    sentences.
    """
    plan = plan_file(wordings=str(stopcube_wordings), forms="implicit")

    rows = exported_rows(tmp_path / "rows.jsonl", "--plan", plan)

    assert {row["task"] for row in rows} == {"StopCube"}
    assert {row["wordings"].partition("@")[0] for row in rows} == {"test"}
    assert {row["whole_sentence"] for row in rows} == {"own"}


def test_two_exports_of_instructions_have_the_same_bytes_and_leave_nothing_else(tmp_path):
    """Words are drawn by the number of the episode, not at random; no temporary file stays."""
    first = tmp_path / "one.jsonl"
    second = tmp_path / "two.jsonl"

    exported_rows(first, "--tasks", "ButtonUnmask,StopCube", "--split", "val")
    exported_rows(second, "--tasks", "ButtonUnmask,StopCube", "--split", "val")

    assert first.read_bytes() == second.read_bytes()
    assert sorted(tmp_path.iterdir()) == [first, second]


def test_exported_instructions_are_those_of_the_asked_tasks_settings_and_split(tmp_path):
    """Two tasks of the split `val` in all settings. StopCube has no spatial setting; with `all`,
    that is no error.
    """
    rows = exported_rows(
        tmp_path / "rows.jsonl", "--tasks", "ButtonUnmask,StopCube", "--split", "val",
        "--settings", "all",
    )  # fmt: skip

    assert {row["split"] for row in rows} == {"val"}
    settings = {(row["task"], row["setting"]) for row in rows}
    assert ("ButtonUnmask", "spatial") in settings
    assert ("StopCube", "direct") in settings
    assert ("StopCube", "spatial") not in settings


def test_exported_instructions_follow_the_options_of_a_plan(tmp_path):
    """Places of the camera's frame, and a dialogue with a competing remark in stage 3."""
    plan = plan_file(stages=[1, 2, 3, 5], distractor="competing", frame="camera", forms="implicit")

    spatial, *_, contextual = exported_rows(
        tmp_path / "rows.jsonl", "--tasks", "ButtonUnmask", "--plan", plan,
        "--settings", "spatial,contextual",
    )  # fmt: skip

    assert (spatial["setting"], spatial["frame"]) == ("spatial", "camera")
    assert (contextual["setting"], contextual["distractor"]) == ("contextual", "competing")
    stages = [turn["stage"] for turn in contextual["turns"]]
    assert stages == ["introduction", "reinforcement", "distractor", "command"]


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
def test_a_wrong_option_of_an_export_is_one_sentence_and_nothing_is_written(
    tmp_path, out, words, kind, sentence
):
    """Cases are a misspelled setting, wrong stages, a task without places, a bad format, bad
    paths."""
    with pytest.raises(kind, match=sentence):
        call("export", "instructions", "--out", tmp_path / out, *words)
    assert not list(tmp_path.iterdir())


def test_stats_print_tables(monkeypatch, snapshot):
    """The stored text has the tables of three tasks: counts of words, of lengths and of referring
    expressions, 150 characters wide.
    """
    monkeypatch.setenv("COLUMNS", "150")
    printed = call("language", "stats", "--tasks", "VideoPlaceButton,VideoUnmask,PickXtimes")
    assert printed == snapshot


def test_stats_of_all_splits_leave_out_empty_tables():
    """StopCube's instructions relate visits in time, so there is a table of relations; they name no
    places, so there is none of landmarks.
    """
    printed = call("language", "stats", "--split", "all", "--tasks", "StopCube")
    assert "Relations" in printed
    assert "Landmark" not in printed


SCENARIO_FILE = """
tasks = ["PickXtimes", "SwingXtimes"]
[[scenario]]
frame = "far"
pool = "train"
setting = "spatial"
introduction = "Look at the cube {place}."
say.color = ["the cube <there place: there>"]
"""
"""It breaks a rule: *there* goes with words for where something is, ``{place:spot}``."""


def check_scenarios(folder, *options):
    """Return the outcome of `roboirg language check-scenarios` on the file above."""
    file = folder / "mine.toml"
    file.write_text(SCENARIO_FILE)
    words = ["language", "check-scenarios", str(file), "--seeds", "0", *options]
    return CliRunner().invoke(cli.app, words)


@pytest.mark.usefixtures("in_this_process")
def test_an_author_sees_texts_and_the_broken_rule_in_each_task(tmp_path, snapshot):
    """The whole print is compared with a stored one; the command fails, as a rule is broken."""
    result = check_scenarios(tmp_path)

    assert isinstance(result.exception, RoboIRGError)
    assert f"{result.stdout}{result.exception}" == snapshot


@pytest.mark.usefixtures("in_this_process")
def test_the_check_refuses_a_misspelled_scenario_with_the_right_name(tmp_path):
    """The file has one scenario, "far"."""
    result = check_scenarios(tmp_path, "--scenario", "fear")
    assert str(result.exception) == "There is no scenario 'fear'; known: far. Did you mean 'far'?"


@pytest.fixture(scope="module")
def rating(tmp_path_factory):
    """A folder with texts for raters: sheets, and a key that tells the scenario of each text."""
    out = tmp_path_factory.mktemp("raters") / "rating"
    settings = ("--settings", "direct,reasoning")
    call("language", "sample", "--out", out, "--tasks", "PickXtimes,SwingXtimes", *settings)
    return out


def read_sheets(rating):
    """Return for each rater the numbers and texts in the order of the sheet."""
    sheets = []
    for path in rating.glob("sheet-*.csv"):
        _, *rows = csv.reader(path.open())
        sheets.append([(int(row[0]), row[1]) for row in rows])
    return sheets


def test_raters_get_one_text_of_each_scenario(rating):
    """The two tasks share scenarios ("frames")."""
    key = rate_words.read_key(rating / "key.csv")
    assert not key.duplicated(["setting", "frame"]).any()


def test_three_raters_get_the_texts_of_the_key_in_other_orders(rating):
    """`rating` is a folder with the key, which tells the scenario of each numbered text, and three
    sheets with the same texts, each in an order of its own, so that no text is always the last.
    """
    texts = rate_words.read_key(rating / "key.csv")["text"].to_dict()
    first, second, third = read_sheets(rating)

    assert dict(first) == dict(second) == dict(third) == texts
    assert len({tuple(first), tuple(second), tuple(third)}) == 3


def test_raters_table_has_intervals_around_equal_ratings(rating):
    """Two raters give 4 of 5 points to every text in both settings, so the mean is 4.0.

    The interval is that of the mean over all scenarios, of which others could be rated worse or
    better; so it is wider than a point although no two ratings differ.
    """
    key = rate_words.read_key(rating / "key.csv")
    ratings = pd.DataFrame({"one rater": 4.0, "another": 4.0}, key.index)

    direct, reasoning = rate_words.rows(key, ratings)

    for setting, _, mean, interval, _ in (direct, reasoning):
        low, high = interval.split(" to ")
        assert mean == "4.0", setting
        assert float(low) < 4.0 < float(high)


def test_an_empty_rating_is_refused_with_its_number(rating):
    """The sheet is as it was written: no rating is filled in."""
    key = rate_words.read_key(rating / "key.csv")

    with pytest.raises(SystemExit, match=r"needs a number from 1 to 5 as the rating of texts 1, 2"):
        rate_words.read_ratings(rating / "sheet-1.csv", key.index)
