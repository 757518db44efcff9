"""`roboirg language ...` and `roboirg export ...`."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest
from plan_files import plan_file
from typer.testing import CliRunner

from roboirg import main as cli
from roboirg.apps.language_lab.validation.validation_results import RuleViolation, ValidationResults
from roboirg.core.errors import InvalidValueError, RoboIRGError, UnknownNameError

HEAVY = ("sapien", "torch", "gymnasium", "toppra", "mani_skill", "cv2", "av")


def call(*words: str | Path) -> str:
    """What the command prints; its errors come as they are."""
    result = CliRunner().invoke(cli.app, [str(word) for word in words], catch_exceptions=False)
    assert result.exit_code == 0, result.output
    return result.output


WORDINGS = """\
name = "test"
[StopCube.phrases]
visit.2 = "for the second time"
visit.3 = "for the third time"
visit.4 = "for the 4th time"
visit.5 = "for the 5th time"
[[StopCube.commands]]
text = "press the button to stop the cube when it reaches the target {visit}"
"""


@pytest.mark.usefixtures("in_this_process")
def test_instructions_in_words_from_outside(tmp_path: Path):
    file, out = tmp_path / "test.toml", tmp_path / "rows.jsonl"
    file.write_text(WORDINGS)
    said = call("show", "StopCube", "0", "--words", "--wordings", file)
    assert said.count("press the button to stop the cube when it reaches the target") == 4
    words = plan_file(wordings=str(file), forms="implicit")
    call("export", "instructions", "--out", out, "--plan", words)
    rows = [json.loads(line) for line in out.read_text().splitlines()]
    assert {row["task"] for row in rows} == {"StopCube"}  # all of the file
    assert {row["wordings"].partition("@")[0] for row in rows} == {"test"}
    (template,) = {row["command_template"] for row in rows}
    assert template == WORDINGS.splitlines()[-1].partition('"')[2][:-1]
    checked = ("--split", "val", "--seeds", "4", "--wordings", file)
    assert "StopCube" in call("language", "validate", *checked)
    with pytest.raises(InvalidValueError, match="have no commands of BinFill"):
        call("show", "BinFill", "0", "--words", "--wordings", file)


def test_validation_finds_what_words_from_outside_break(tmp_path: Path):
    file = tmp_path / "test.toml"
    file.write_text(WORDINGS.replace("the 4th time", "the third time"))
    with pytest.raises(RoboIRGError, match="broken rule"):
        call("language", "validate", "--split", "val", "--seeds", "0", "--wordings", file)


def test_all_test_episodes_are_exported_without_a_simulator(tmp_path: Path):
    out = tmp_path / "instructions.jsonl"
    program = (
        "import sys\n"
        "from roboirg.main import main\n"
        f"sys.argv = ['roboirg', 'export', 'instructions', '--out', {str(out)!r}]\n"
        "try:\n    main()\nexcept SystemExit as left:\n    assert not left.code\n"
        f"print([name for name in {HEAVY!r} if name in sys.modules])\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, check=True, timeout=60
    )
    assert done.stdout.splitlines()[-1] == "[]"
    rows = [json.loads(line) for line in out.read_text().splitlines()]
    assert len({(row["task"], row["episode"]) for row in rows}) == 550
    variants = {(row["task"], row["setting"], row["form"]) for row in rows}
    assert sum(form == "resolved" and setting != "explicit" for _, setting, form in variants) == 40
    assert sum(form == "implicit" and setting != "explicit" for _, setting, form in variants) == 40
    assert len(rows) == 50 * len(variants)


def test_the_same_bytes_every_time_and_only_what_is_asked_for(tmp_path: Path):
    files = [tmp_path / "one.jsonl", tmp_path / "two.jsonl"]
    for file in files:
        words = ("--tasks", "VideoUnmask,StopCube", "--settings", "spatial,direct")
        call("export", "instructions", "--out", file, *words, "--plan", plan_file(forms="implicit"))
    assert files[0].read_bytes() == files[1].read_bytes()
    rows = [json.loads(line) for line in files[0].read_text().splitlines()]
    assert len(rows) == 50 * 3
    assert {row["setting"] for row in rows if row["task"] == "StopCube"} == {"direct"}
    assert [path.name for path in sorted(tmp_path.iterdir())] == ["one.jsonl", "two.jsonl"]


def test_options_of_the_words_are_passed_on(tmp_path: Path):
    out = tmp_path / "rows.jsonl"
    words = plan_file(stages=[1, 2, 3, 5], distractor="competing", frame="camera")
    call(
        "export",
        "instructions",
        "--out",
        out,
        "--tasks",
        "ButtonUnmask",
        "--split",
        "val",
        "--plan",
        words,
    )
    rows = [json.loads(line) for line in out.read_text().splitlines()]
    contextual = next(row for row in rows if row["setting"] == "contextual")
    assert [turn["stage"] for turn in contextual["turns"]][1:3] == ["reinforcement", "distractor"]
    assert contextual["distractor"] == "competing"
    assert {row["frame"] for row in rows} == {None, "camera"}
    assert {row["split"] for row in rows} == {"val"}


@pytest.mark.parametrize(
    ("words", "kind", "sentence"),
    [
        (("--settings", "spatail"), UnknownNameError, "Did you mean 'spatial'?"),
        (("--plan", plan_file(forms="implied")), UnknownNameError, "There is no form 'implied'"),
        (("--tasks", "StopCub"), UnknownNameError, "Did you mean 'StopCube'?"),
        (("--split", "dev"), UnknownNameError, "There is no split 'dev'"),
        (("--plan", plan_file(stages="2,5")), InvalidValueError, "must be one of"),
        (("--tasks", "StopCube", "--settings", "spatial"), InvalidValueError, "None of these"),
    ],
)
def test_what_is_wrong_is_one_sentence(tmp_path: Path, words, kind, sentence):
    with pytest.raises(kind, match=sentence.replace("?", r"\?")):
        call("export", "instructions", "--out", tmp_path / "out.jsonl", *words)
    assert not list(tmp_path.iterdir())


def test_the_name_of_an_export_has_its_format(tmp_path: Path):
    with pytest.raises(UnknownNameError, match="There is no format 'csv'"):
        call("export", "instructions", "--out", tmp_path / "out.csv")


def test_an_export_needs_a_place(tmp_path: Path):
    for path in (tmp_path, tmp_path / "nowhere" / "out.jsonl"):
        with pytest.raises(InvalidValueError, match="is not a file in an existing folder"):
            call("export", "instructions", "--out", path)


def test_stats_print_tables_and_draw_the_figure(tmp_path: Path):
    pytest.importorskip("matplotlib")
    printed = call("language", "stats", "--tasks", "PickXtimes,VideoUnmask", "--out", tmp_path)
    for title in ("Words per instruction", "Referring expressions", "Landmark classes"):
        assert title in printed
    names = {path.name for path in tmp_path.iterdir()}
    assert names >= {"expressions-test.png", "expressions-test-dark.svg"}


def test_stats_of_all_splits_need_no_figure():
    printed = call("language", "stats", "--split", "all", "--tasks", "StopCube")
    assert "Relations" in printed
    assert "Landmark" not in printed


@pytest.mark.usefixtures("in_this_process")
def test_validate_prints_what_was_read_and_the_exceptions():
    words = ("--tasks", "PickXtimes", "--split", "none", "--seeds", "4")
    printed = call("language", "validate", *words)
    assert "Texts read back" in printed
    assert "2 of 2" in printed  # easy, spatial
    assert "0 of 1" in printed


@pytest.mark.usefixtures("in_this_process")
def test_a_broken_rule_is_told_and_ends_with_a_sentence(monkeypatch: pytest.MonkeyPatch):
    failure = RuleViolation("no leak", "PickXtimes", "direct", "PickXtimes/test/0", 7, "[red]ly")
    found = ValidationResults(failures=[failure])
    found.texts["PickXtimes", "direct"] = 1
    monkeypatch.setattr(
        "roboirg.apps.language_lab.validation.validation_run.validate_batch", lambda _batch: found
    )
    words = ("--tasks", "PickXtimes", "--split", "none", "--seeds", "1")
    result = CliRunner().invoke(cli.app, ["language", "validate", *words])
    assert isinstance(result.exception, RoboIRGError)
    assert "Found 1 broken rule in 1 text." in str(result.exception)
    assert "no leak: PickXtimes/test/0, seed 7, direct: [red]ly" in result.output
