from __future__ import annotations

import contextlib
import json
import os
import re
import signal
import subprocess
import sys
import time
from collections.abc import Mapping
from importlib.metadata import version
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from made_records import make_record
from page_text import store
from plan_files import plan_file

from roboirg import main as cli
from roboirg.apps.show import playthrough
from roboirg.apps.show.episode_strip import StripMoment
from roboirg.cli import progress_bar
from roboirg.cli.progress_bar import progress_bars
from roboirg.cli.run_commands import report_problems
from roboirg.records.record import Job
from roboirg.runs.plan.plan_maker import make_plan
from roboirg.runs.plan.stored_plans import read_plan
from roboirg.runs.run.runner import RunSummary
from roboirg.util.console_width import progress_console

RUN = ("run", "--policy", "random", "--tasks", "PickXtimes")


@pytest.fixture
def roboirg(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]):
    """The command, in this process."""

    def call(*words: str | Path) -> SimpleNamespace:
        monkeypatch.setattr(sys, "argv", ["roboirg", *map(str, words)])
        try:
            cli.main()
            code = 0
        except SystemExit as left:
            code = left.code if isinstance(left.code, int) else 0
        told = capsys.readouterr()
        return SimpleNamespace(code=code, out=told.out, err=told.err)

    return call


class CannedPlayer:
    """Stands in for `EpisodeRunner`: no simulator, and the outcome that the test asks for."""

    result: Mapping[str, Any] = {"outcome": "success", "steps": 7}

    def __init__(self, folder: Path, video: str, **_options: object) -> None:
        del folder, video

    def __call__(self, job: Job):
        return make_record(job, **self.result)


@pytest.fixture
def canned(monkeypatch: pytest.MonkeyPatch) -> type[CannedPlayer]:
    monkeypatch.setattr("roboirg.runs.run.runner.EpisodeRunner", CannedPlayer)
    monkeypatch.setattr(CannedPlayer, "result", {"outcome": "success", "steps": 7})
    return CannedPlayer


def planned(**fields: object) -> tuple[str, ...]:
    """Return the words of a run with a plan file."""
    return (*RUN, "--plan", plan_file(**fields))


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        ((*RUN, "--settings", "implicit"), "'implicit' is a form of the instruction"),
        ((*RUN, "--episodes", "9" * 5000), "…' is not a valid episode; write numbers and ranges"),
        ((*RUN, "--stages", "5-1"), "the possible lists are 1,5;"),
        ((*RUN, "--out", ""), "The run's folder is ''; it must be a path"),
        (("report", "x" * 260), "xxx' cannot be used: File name too long."),
        ((*RUN, "--episodes", "50,"), "no episode 50: split 'test' has episodes 0 to 49."),
        ((*RUN, "--policy", "../../x=random"), "is '../../x' (in '../../x=random')"),
        (planned(actions="joints"), "known: joint_angle, ee_pose, waypoint, choice."),
        (planned(episode_timeout_s=1e30), "it must be at most 2147483."),
        (planned(long_prompts="cut"), "it must be 'send' or 'refuse'."),
        (planned(distractor="nutral"), "Did you mean 'neutral'?"),
        (planned(instruction={"distracter": "neutral"}), "distracter"),
        (planned(instruction={"setting": "direct"}), "no key of instruction 'setting'"),
        (("run", "--plan", "paper"), "No policy given"),
        (("run", "--plan", "demo", "--out", " "), "folder"),
        (("play",), "play"),
        (("report", "nowhere"), "nowhere"),
        (("show", "PickXtimes", "50"), "There is no episode 50"),
        (("show", "PickXtimes", "0", "--out", "sheet.gif"), "must end in .png"),
    ],
)  # fmt: skip
def test_what_is_wrong_is_one_sentence_and_exit_code_2(
    roboirg, tmp_path, monkeypatch, words, sentence
):
    monkeypatch.chdir(tmp_path)
    said = roboirg(*words)

    assert (said.code, said.out, said.err.count("\n")) == (2, "", 1)
    assert said.err.startswith("roboirg: ")
    assert sentence in said.err
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("words", ["tasks", "--help", "tables --published --which main",
                                   "tables --published --format csv"])  # fmt: skip
def test_an_output_that_cannot_be_written_is_one_sentence(words):
    command = [sys.executable, "-m", "roboirg", *words.split()]
    with Path("/dev/full").open("w") as full:
        child = subprocess.run(command, stdout=full, stderr=subprocess.PIPE, text=True, check=False)

    assert child.stderr == "roboirg: The output cannot be written: No space left on device.\n"
    assert child.returncode == 2


def test_a_reader_that_leaves_is_no_error():
    read, write = os.pipe()
    os.close(read)
    command = [sys.executable, "-m", "roboirg", "tasks"]
    child = subprocess.run(command, stdout=write, stderr=subprocess.PIPE, text=True, check=False)

    os.close(write)

    assert (child.returncode, child.stderr) == (1, "")


def test_help_and_version_are_answered(roboirg):
    assert roboirg("--version").out == f"roboirg {version('roboirgbench')}\n"
    for words in (("--help",), ("run", "-h")):
        said = roboirg(*words)
        assert (said.code, said.err) == (0, "")
        assert "Usage" in said.out
    assert roboirg().code in {0, 2}  # Click before 8.2 sees no fault in it


def test_a_missing_pyav_is_told_before_anything_is_played(roboirg, tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "av", None)
    said = roboirg("run", "--plan", "demo", "--out", tmp_path / "out")

    assert (said.code, said.out, said.err.count("\n")) == (2, "", 1)
    assert not (tmp_path / "out").exists()


def test_lost_videos_are_reported_once(roboirg, tmp_path, monkeypatch, canned):
    def play(_self: CannedPlayer, job: Job):
        return make_record(job, **canned.result, video_error="OSError: disk full")

    monkeypatch.setattr(CannedPlayer, "__call__", play)
    words = (*RUN, "--episodes", "2", "--workers", "0", "--video", "all", "--out", tmp_path)

    said = roboirg(*words)

    assert said.code == 0
    assert said.err == (
        "10 of 10 videos could not be written; the verdicts are not affected. "
        "First error: OSError: disk full\n"
    )
    assert roboirg(*words).err == ""


@pytest.mark.usefixtures("canned")
def test_a_run_goes_on_where_it_was_and_has_a_report(roboirg, tmp_path):
    command = (*RUN, "--episodes", "2", "--workers", "0", "--out", tmp_path)
    said = roboirg(*command)
    assert said.code == 0, said.err
    lines = (tmp_path / "records.jsonl").read_text().splitlines()
    assert "[1/10] random PickXtimes test/0 direct: success" in said.out
    assert len(lines) == 10
    keys = {"policy", "task", "split", "episode", "seed", "difficulty", "options"}
    assert keys | {"policy_seed", "outcome", "cause", "steps"} <= set(json.loads(lines[0]))

    again = roboirg(*command)
    assert "10 of 10 episodes already stored." in again.out

    told = roboirg("report", tmp_path)
    assert told.code == 0
    assert "PickXtimes" in told.out
    assert told.out.splitlines()[-1] == str(tmp_path / "report.html")
    assert (tmp_path / "report.html").exists()


def test_errors_are_told_and_are_exit_code_2(roboirg, tmp_path, canned):
    cause = "invalid action: Action value 3 is nan"
    canned.result = {"outcome": "error", "error": "invalid_action", "cause": cause, "steps": 2}
    command = (*RUN, "--episodes", "1", "--workers", "0", "--out", tmp_path)
    said = roboirg(*command)

    assert said.code == 2
    assert "5 of 5 episodes ended in an error" in said.err
    assert "Action value 3 is nan" in said.err

    canned.result = {"outcome": "success"}
    assert roboirg(*command).code == 0


def test_instructions_are_printed(roboirg, snapshot):
    said = roboirg(
        "show", "PickXtimes", "3", "--words", "--settings", "contextual", "--stages", "1,5"
    )
    assert said.out + roboirg("show", "VideoUnmask", "0", "--words").out == snapshot

    wrong = roboirg("show", "VideoUnmask", "99", "--words")
    assert (wrong.code, wrong.err.count("\n")) == (2, 1)


def test_failures_are_named_below_the_table(roboirg, tmp_path, canned):
    canned.result = {"outcome": "failure", "cause": "pressed the button too early"}
    said = roboirg(*RUN, "--episodes", "3", "--workers", "0", "--out", tmp_path)

    assert said.code == 0
    assert "random: 15 episodes without success" in said.out
    assert "  PickXtimes test/0 explicit: pressed the button too early\n" in said.out
    assert "and 5 more" in said.out
    assert "and 5 more" in roboirg("report", tmp_path).out


def test_an_episode_is_shown(roboirg, tmp_path, monkeypatch, snapshot):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "100")
    save = lambda _, path, **__: Path(path).touch()  # noqa: E731
    monkeypatch.setattr("matplotlib.figure.Figure.savefig", save)
    picture = StripMoment(7, "the end", np.zeros((256, 256, 3), np.uint8))
    played = playthrough.Playthrough("success", 7, (picture,))
    monkeypatch.setattr(playthrough, "play_through", lambda _: played)
    said = roboirg("show", "VideoPlaceButton", "3", "--split", "val")

    assert (said.code, said.err) == (0, "")

    names = [f"VideoPlaceButton-val-3{end}.png" for end in ("", "-dark")]
    assert sorted(path.name for path in tmp_path.iterdir()) == sorted(names)
    assert said.out == snapshot


def test_help_needs_nothing_heavy():
    code = (
        "import sys; sys.argv = ['roboirg', '--help']\n"
        "from roboirg.main import main\n"
        "try: main()\n"
        "except SystemExit: pass\n"
        "heavy = {'numpy', 'pydantic', 'sapien', 'gymnasium', 'jinja2', 'av'} & set(sys.modules)\n"
        "assert not heavy, heavy"
    )
    subprocess.run([sys.executable, "-c", code], check=True, capture_output=True)


NOTE_HANDLER = """
import signal
from roboirg import __main__
install = signal.signal
def note(*handler):
    install(*handler)
    signal.signal = install
    print(flush=True)
signal.signal = note
__main__.main()
"""


def test_ctrl_c_at_any_moment_is_one_sentence():
    ends = []
    for delay_s in np.linspace(0, 0.24, 5):
        command = subprocess.Popen(
            [sys.executable, "-c", NOTE_HANDLER, "run", "--help"],
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            start_new_session=True,
        )
        assert command.stdout is not None
        command.stdout.readline()  # what comes before is Python's
        time.sleep(delay_s)
        with contextlib.suppress(ProcessLookupError):
            os.killpg(command.pid, signal.SIGINT)
        _, errors = command.communicate()
        ends.append((command.returncode, errors))
    stopped = 130, "roboirg: stopped.\n"

    # The last ones may have ended before, or be Python's again.
    assert set(ends) <= {stopped, (0, ""), (-signal.SIGINT, "")}
    assert stopped in ends


INTERRUPTED_CLASS = """
import os, signal
from roboirg import __main__, main
class Field:
    def __set_name__(self, owner, name):
        os.kill(os.getpid(), signal.SIGINT)
        for _ in range(1000):
            pass
def run():
    class Owner:
        field = Field()
main.main = run
__main__.main()
"""


def test_ctrl_c_within_a_class_definition_is_one_sentence():
    # Python 3.11 makes a RuntimeError of it, as happened while a library was imported.
    ended = subprocess.run(
        [sys.executable, "-c", INTERRUPTED_CLASS], capture_output=True, text=True, check=False
    )
    assert (ended.returncode, ended.stderr) == (130, "roboirg: stopped.\n")


def test_episodes_that_were_not_played_are_an_error(capsys):
    summary = RunSummary(10, 7, (), 3, (), ())
    with pytest.raises(SystemExit, match="2"):
        report_problems(summary, Path("out"))
    assert "3 of 10 episodes were not played; run the same command" in capsys.readouterr().err


def test_what_is_typed_goes_before_what_the_plan_says(roboirg, tmp_path, canned):
    del canned
    plan = tmp_path / "plan.yaml"
    plan.write_text("policies: [random]\ntasks: StopCube\nsettings: explicit\nepisodes: 3\n")
    said = roboirg("run", "--plan", plan, "--episodes", "2", "--workers", "0", "--out", tmp_path)

    assert said.code == 0

    made = read_plan(tmp_path)
    assert made is not None
    assert [policy.spec for policy in made.policies] == ["random"]
    assert (made.tasks, made.episodes) == (("StopCube",), (0, 1))


def test_a_dry_run_counts_and_plays_nothing(roboirg, tmp_path):
    model = "p=planner:stateless?model=x&base_url=http://localhost:1/v1"
    words = ("run", "--plan", "paper", "--policy", model, "--dry-run", "--out", tmp_path / "out")

    said = roboirg(*words)

    assert "least calls of models" in said.out
    assert said.code == 0
    assert "150 + 150" in said.out
    assert "13,650 episodes, 0 already stored. Workers: one per core" in " ".join(said.out.split())
    assert not (tmp_path / "out").exists()


def test_a_dry_run_counts_calls_of_models_for_what_is_still_to_be_played(roboirg, tmp_path):
    model = "p=vlm-listener:openai?model=x&base_url=http://localhost:1/v1"
    played = make_plan([model], tasks="PickXtimes", settings="direct", episodes="1").jobs()
    store(tmp_path, [make_record(job, "success") for job in played])
    words = ("--tasks", "PickXtimes", "--settings", "direct", "--episodes", "3", "--dry-run")

    said = roboirg("run", "--policy", model, *words, "--out", tmp_path)

    assert re.search(r"p\W+direct\W+2\W", said.out)


@pytest.mark.parametrize(
    ("words", "caption"),
    [
        (("--settings", "explicit"), "episodes"),
        (("--settings", "direct", "--forms", "implicit,resolved"), "episodes: implicit + resolved"),
    ],
)
def test_a_dry_run_names_the_forms_it_counts(roboirg, tmp_path, words, caption):
    said = roboirg(*RUN, *words, "--dry-run", "--out", tmp_path / "out")
    assert caption in map(str.strip, said.out.splitlines())


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (("--out", "{file}"), "Cannot write to {file}: {file} is not a folder"),
        (("--out", "{file}/deep/er"), "{file} is not a folder"),
        (("--out", "{other}"), "language version is 1.1"),
    ],
)
def test_a_dry_run_checks_what_a_run_checks(roboirg, tmp_path, words, sentence):
    file = tmp_path / "file"
    other = tmp_path / "other"
    file.write_text("x")
    (job,) = make_plan(["random"], tasks="PickXtimes", settings="direct", episodes="1").jobs()
    store(other, [make_record(job, "success", language_version="1.1")])
    places = {"file": file, "other": other}
    given = [word.format(**places) for word in words]

    before = sorted(tmp_path.rglob("*"))

    # Twice: without --dry-run, too.
    for last in (["--dry-run"], []):
        said = roboirg(*RUN, "--out", tmp_path / "out", *given, *last)
        assert said.code == 2, said
        assert sentence.format(**places) in said.err
        assert len(said.err.splitlines()) == 1
        if last:
            assert sorted(tmp_path.rglob("*")) == before


def test_a_run_s_own_plan_can_be_played_again(roboirg, tmp_path, canned):
    del canned
    words = "--settings contextual,direct --stages 1,5;1-5 --episodes 3,"
    words += f" --plan {plan_file(retry_on='none', frame='camera')}"
    words += " --wordings train --forms implicit,resolved --workers 0 --out"
    first = roboirg(*RUN, *words.split(), tmp_path / "a")

    assert first.code == 0, first.err

    plan = tmp_path / "a" / "plan.json"
    again = roboirg("run", "--plan", plan, "--workers", "0", "--out", tmp_path / "b")
    assert again.code == 0, again.err
    assert read_plan(tmp_path / "b") == read_plan(tmp_path / "a")


class Wanderer(CannedPlayer):
    """Changes the working directory, as a policy in the command's own process may."""

    away = Path()

    def __call__(self, job: Job):
        os.chdir(self.away)
        return super().__call__(job)


def test_a_relative_folder_stays_where_it_is(roboirg, tmp_path, monkeypatch):
    home = tmp_path / "home"
    away = tmp_path / "away"
    home.mkdir()
    away.mkdir()
    monkeypatch.chdir(home)
    monkeypatch.setattr("roboirg.runs.run.runner.EpisodeRunner", Wanderer)
    monkeypatch.setattr(Wanderer, "away", away)

    said = roboirg(*RUN, "--episodes", "2", "--workers", "0", "--out", "mine")

    assert said.code == 0, said.err
    assert (home / "mine" / "records.jsonl").exists()
    assert list(away.iterdir()) == []


def test_unfinished_videos_of_a_run_that_died_are_deleted(roboirg, tmp_path, canned):
    videos = tmp_path / "videos"
    videos.mkdir()
    for name in (".a.mp4.part", "b.mp4", ".c.mp4.part.keep"):
        (videos / name).write_bytes(b"x")
    (videos / ".d.mp4.part").mkdir()  # not ours

    assert roboirg(*RUN, "--workers", "0", "--out", tmp_path).code == 0
    assert {path.name for path in videos.iterdir()} == {"b.mp4", ".c.mp4.part.keep", ".d.mp4.part"}


def test_long_lists_of_options_have_panels(roboirg, monkeypatch):
    monkeypatch.setenv("COLUMNS", "80")
    out = roboirg("run", "--help").out
    assert "\x1b" not in out  # no color in what is no terminal

    panels = re.split(r"╭─ (.+?) ─+╮", out)[1:]
    sizes = {
        name: len(re.findall(r"(?m)^│ [ *] {0,3}--|^│ --", body))
        for name, body in zip(panels[::2], panels[1::2], strict=True)
    }
    assert len(sizes) == 4
    assert all(1 < size <= 9 for size in sizes.values()), sizes


def test_progress_moves_no_cursor_in_a_pipe_even_if_colors_are_forced(monkeypatch, capsys):
    monkeypatch.setenv("FORCE_COLOR", "1")
    # The time left goes by what was done since the first of them.
    times = iter([0, 20, 60, 65, 100, 101])
    monkeypatch.setattr(progress_bar, "time", SimpleNamespace(monotonic=times.__next__))

    with progress_bars() as report:
        for done in (3, 5, 6, 9, 10):
            report("record", done, 10, "done" if done == 10 else "")

    assert not progress_console().is_terminal
    assert capsys.readouterr().err.splitlines() == [
        "record 3/10", "record 5/10 2 min left", "record 9/10 17 s left", "record 10/10  done",
    ]  # fmt: skip
