"""The command line: exit codes, what is printed, Ctrl-C, dry runs, and what stays where."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
import time
from importlib.metadata import version
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from made_records import make_record
from page_text import store
from plan_files import plan_file
from python_process import print_of_python, run_python

from roboirg.apps.show import playthrough
from roboirg.apps.show.episode_strip import StripMoment
from roboirg.cli import progress_bar
from roboirg.cli.progress_bar import progress_bars
from roboirg.cli.run_commands import report_problems
from roboirg.runs.plan.plan_maker import make_plan
from roboirg.runs.plan.stored_plans import read_plan
from roboirg.runs.run.runner import RunSummary
from roboirg.util.console_width import progress_console

RUN_RANDOM = ("run", "--policy", "random", "--tasks", "PickXtimes")
RUN_TEN_EPISODES = (*RUN_RANDOM, "--episodes", "2", "--workers", "0", "--out")
"""Two episodes of PickXtimes in each of five settings; a folder follows."""


class CannedPlayer:
    """Stands in for `EpisodeRunner`: no simulator, and the outcome that the test asks for."""

    result = {"outcome": "success", "steps": 7}  # noqa: RUF012

    def __init__(self, folder, video, **_options):
        del folder, video

    def __call__(self, job):
        return make_record(job, **self.result)


@pytest.fixture
def play_without_simulator(monkeypatch):
    """Episodes succeed after seven steps, or end as the function is told that this gives."""
    monkeypatch.setattr("roboirg.runs.run.runner.EpisodeRunner", CannedPlayer)

    def end_with(outcome, **fields):
        monkeypatch.setattr(CannedPlayer, "result", {"outcome": outcome, **fields})

    end_with("success", steps=7)
    return end_with


def check_refused(roboirg, words, sentence):
    """Assert that a command with these words is refused in one sentence, with exit code 2."""
    result = roboirg(*words)

    assert (result.code, result.out, result.err.count("\n")) == (2, "", 1)
    assert result.err.startswith("roboirg: ")
    assert sentence in result.err


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (("--settings", "implicit"), "'implicit' is a form of the instruction"),
        (("--episodes", "9" * 5000), "…' is not a valid episode; write numbers and ranges"),
        (("--stages", "5-1"), "the possible lists are 1,5;"),
        (("--policy", "../../x=random"), "is '../../x' (in '../../x=random')"),
    ],
)
def test_a_run_with_a_wrong_option_is_refused_in_a_sentence_with_its_value(
    roboirg, tmp_path, monkeypatch, words, sentence
):
    """The command, `roboirg run --policy random --tasks PickXtimes` and an option, writes nothing.
    An overlong value is cut off in the sentence."""
    monkeypatch.chdir(tmp_path)

    check_refused(roboirg, [*RUN_RANDOM, *words], sentence)

    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("fields", "sentence"),
    [
        ({"actions": "joints"}, "known: joint_angle, ee_pose, waypoint, choice."),
        ({"episode_timeout_s": 1e30}, "it must be at most 2147483."),
        ({"distractor": "nutral"}, "Did you mean 'neutral'?"),
        ({"instruction": {"distracter": "neutral"}}, "distracter"),
        ({"instruction": {"setting": "direct"}}, "no key of instruction 'setting'"),
    ],
)
def test_a_run_with_a_wrong_field_in_its_plan_file_is_refused_in_a_sentence(
    roboirg, fields, sentence
):
    """Names, numbers and keys of the plan are checked; the sentence has what would be right, or
    what is wrong."""
    check_refused(roboirg, [*RUN_RANDOM, "--plan", plan_file(**fields)], sentence)


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (["run", "--plan", "paper"], "No policy given"),
        (["play"], "play"),
        (["report", "nowhere"], "nowhere"),
        (["report", "x" * 260], "xxx' cannot be used: File name too long."),
        (["show", "PickXtimes", "50"], "There is no episode 50"),
        (["show", "PickXtimes", "0", "--out", "sheet.gif"], "must end in .png"),
    ],
)
def test_a_command_with_a_missing_or_wrong_argument_is_refused_in_a_sentence(
    roboirg, tmp_path, monkeypatch, words, sentence
):
    """A policy is missing, a command, a folder or an episode does not exist, a file name is too
    long or has an ending that cannot be written; nothing is written."""
    monkeypatch.chdir(tmp_path)

    check_refused(roboirg, words, sentence)

    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("words", ["--help", "tables --published --format csv"])
def test_a_command_whose_output_cannot_be_written_ends_in_one_sentence(words):
    """As into a full disk: /dev/full refuses every byte."""
    command = [sys.executable, "-m", "roboirg", *words.split()]
    with Path("/dev/full").open("w") as full:
        child = subprocess.run(command, stdout=full, stderr=subprocess.PIPE, text=True, check=False)

    assert child.stderr == "roboirg: The output cannot be written: No space left on device.\n"
    assert child.returncode == 2


def test_a_command_whose_reader_has_closed_the_pipe_prints_no_error():
    """As `roboirg tasks | head -1`."""
    read, write = os.pipe()
    os.close(read)
    command = [sys.executable, "-m", "roboirg", "tasks"]
    child = subprocess.run(command, stdout=write, stderr=subprocess.PIPE, text=True, check=False)

    os.close(write)

    assert (child.returncode, child.stderr) == (1, "")


def test_the_version_is_printed(roboirg):
    assert roboirg("--version").out == f"roboirg {version('roboirgbench')}\n"


def test_help_has_a_short_option(roboirg):
    result = roboirg("run", "-h")

    assert (result.code, result.err) == (0, "")
    assert "Usage" in result.out


def test_without_pyav_a_run_with_videos_is_refused_before_anything_is_played(
    roboirg, tmp_path, monkeypatch
):
    """PyAV, which writes videos, cannot be imported, as where it is not installed. The plan "demo"
    asks for videos, so the run fails in one line, without a folder."""
    monkeypatch.setitem(sys.modules, "av", None)
    result = roboirg("run", "--plan", "demo", "--out", tmp_path / "out")

    assert (result.code, result.out, result.err.count("\n")) == (2, "", 1)
    assert not (tmp_path / "out").exists()


def test_videos_that_could_not_be_written_are_reported_once_and_change_no_verdict(
    roboirg, tmp_path, play_without_simulator
):
    """The run has two episodes in each of five settings, ten in all. Each succeeds, but the disk is
    full for its video, so the exit code is 0. The same command then has nothing left to play, and
    nothing to report."""
    play_without_simulator("success", video_error="OSError: disk full")

    first = roboirg(*RUN_TEN_EPISODES, tmp_path, "--video", "all")
    second = roboirg(*RUN_TEN_EPISODES, tmp_path, "--video", "all")

    assert first.code == 0
    assert first.err == (
        "10 of 10 videos could not be written; the verdicts are not affected. "
        "First error: OSError: disk full\n"
    )
    assert second.err == ""


@pytest.mark.usefixtures("play_without_simulator")
def test_a_run_prints_a_line_and_stores_a_record_for_each_episode(roboirg, tmp_path):
    """Two episodes in each of five settings; the fixture has all succeed without a simulator."""
    result = roboirg(*RUN_TEN_EPISODES, tmp_path)

    assert result.code == 0, result.err
    assert "[1/10] random PickXtimes test/0 direct: success" in result.out
    assert len((tmp_path / "records.jsonl").read_text().splitlines()) == 10


@pytest.mark.usefixtures("play_without_simulator")
def test_report_prints_the_results_then_the_path_of_the_page_that_it_writes(roboirg, tmp_path):
    """The run has ten episodes of PickXtimes, which the fixture has succeed without a simulator."""
    roboirg(*RUN_TEN_EPISODES, tmp_path)

    result = roboirg("report", tmp_path)

    assert "PickXtimes" in result.out
    assert result.out.splitlines()[-1] == str(tmp_path / "report.html")
    assert (tmp_path / "report.html").exists()


def test_a_run_with_errors_has_exit_code_2_and_names_the_first_cause(
    roboirg, tmp_path, play_without_simulator
):
    """The run has two episodes in each of five settings; `play_without_simulator` has all ten end
    in an error of the policy, which is no failure of it."""
    cause = "invalid action: Action value 3 is nan"
    play_without_simulator("error", error="invalid_action", cause=cause)

    result = roboirg(*RUN_TEN_EPISODES, tmp_path)

    assert result.code == 2
    assert "10 of 10 episodes ended in an error" in result.err
    assert "Action value 3 is nan" in result.err


def test_a_run_with_errors_has_exit_code_0_once_they_were_played_again(
    roboirg, tmp_path, play_without_simulator
):
    """`play_without_simulator` has all episodes end in an error at first; when the same command
    plays them again, they succeed."""
    play_without_simulator("error", error="invalid_action", cause="nan")
    roboirg(*RUN_TEN_EPISODES, tmp_path)

    play_without_simulator("success")

    assert roboirg(*RUN_TEN_EPISODES, tmp_path).code == 0


def test_show_words_prints_the_utterances_of_an_instruction(roboirg):
    words = ("show", "PickXtimes", "3", "--words")
    result = roboirg(*words, "--settings", "contextual", "--stages", "1,5")

    assert result.out == (
        "contextual (32 tokens):\n"
        "  introduction  Four of my students missed the demo.\n"
        "  command       Grab the blue cube and place it on the target once for each of them, "
        "then press the button.\n"
    )


def test_show_words_prints_the_instructions_in_each_setting_by_default(roboirg, snapshot):
    assert roboirg("show", "VideoUnmask", "0", "--words").out == snapshot


@pytest.fixture
def _drawn_without_simulator(tmp_path, monkeypatch):
    """The oracle succeeds after seven steps, with one picture; figures are saved as empty files."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "100")

    def save(_figure, path, **_options):
        Path(path).touch()

    monkeypatch.setattr("matplotlib.figure.Figure.savefig", save)
    picture = StripMoment(7, "the end", np.zeros((256, 256, 3), np.uint8))
    played = playthrough.Playthrough("success", 7, (picture,))
    monkeypatch.setattr(playthrough, "play_through", lambda _: played)


@pytest.mark.usefixtures("_drawn_without_simulator")
def test_show_prints_scene_goal_and_instructions_of_an_episode_and_how_the_oracle_did(
    roboirg, snapshot
):
    result = roboirg("show", "VideoPlaceButton", "3", "--split", "val")

    assert (result.code, result.err) == (0, "")
    assert result.out == snapshot


@pytest.mark.usefixtures("_drawn_without_simulator")
def test_show_writes_a_light_and_a_dark_picture_of_an_episode(roboirg, tmp_path):
    roboirg("show", "VideoPlaceButton", "3", "--split", "val")

    written = {path.name for path in tmp_path.iterdir()}
    assert written == {"VideoPlaceButton-val-3.png", "VideoPlaceButton-val-3-dark.png"}


def test_help_imports_no_large_library():
    """Would find a command line that takes seconds to answer."""
    code = (
        "import sys; sys.argv = ['roboirg', '--help']\n"
        "from roboirg.main import main\n"
        "try: main()\n"
        "except SystemExit: pass\n"
        "heavy = {'numpy', 'pydantic', 'sapien', 'gymnasium', 'jinja2', 'av'} & set(sys.modules)\n"
        "assert not heavy, heavy"
    )
    print_of_python("-c", code)


PRINT_WHEN_CTRL_C_IS_HANDLED = """
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


def interrupt_help_after(delay_s):
    """Interrupt `roboirg run --help` so long after it has begun to handle Ctrl-C.

    Before that, Python handles it. Returns the exit code and what is printed as errors.
    """
    command = [sys.executable, "-c", PRINT_WHEN_CTRL_C_IS_HANDLED, "run", "--help"]
    pipe = subprocess.PIPE
    with subprocess.Popen(command, stdout=pipe, stderr=pipe, text=True) as process:
        process.stdout.readline()
        time.sleep(delay_s)
        process.send_signal(signal.SIGINT)
        _, errors = process.communicate()
    return process.returncode, errors


def test_ctrl_c_as_a_command_begins_prints_one_sentence():
    """It is pressed as soon as the command handles it. 130 is the usual exit code for it."""
    assert interrupt_help_after(0.0) == (130, "roboirg: stopped.\n")


@pytest.mark.parametrize("delay_s", [0.06, 0.12, 0.18, 0.24])
def test_ctrl_c_at_any_moment_prints_no_traceback(delay_s):
    """The command takes about as long as the longest delay. So it is stopped with one sentence, has
    ended before without an error, or is at its very end, where Python lets the signal end it."""
    code, errors = interrupt_help_after(delay_s)

    assert errors in ("", "roboirg: stopped.\n")
    assert code in (130, 0, -signal.SIGINT)
    assert (code == 130) == (errors != "")


INTERRUPT_IN_A_CLASS_BODY = """
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


def test_ctrl_c_within_a_class_definition_prints_one_sentence():
    """Python 3.11 makes a RuntimeError of it, as happened while a library was imported."""
    ended = run_python("-c", INTERRUPT_IN_A_CLASS_BODY)
    assert (ended.returncode, ended.stderr) == (130, "roboirg: stopped.\n")


def test_a_run_with_missing_episodes_has_exit_code_2_and_asks_for_the_same_command(capsys):
    """Of ten planned episodes seven were played, and three are missing."""
    planned = 10
    played = 7
    missing = 3
    summary = RunSummary(planned, played, (), missing, (), ())

    with pytest.raises(SystemExit, match="2"):
        report_problems(summary, Path("out"))

    assert "3 of 10 episodes were not played; run the same command" in capsys.readouterr().err


def test_a_dry_run_prints_episodes_and_model_calls(roboirg):
    """The paper's plan has 50 test episodes of 11 tasks with 3 seeds, 150 for each task: once in
    the setting *explicit*, and in two forms, "150 + 150", in *direct*, *reasoning*, *contextual*
    and, for 7 tasks, *spatial*. The planner asks a model, whose calls are counted."""
    model = "p=planner:stateless?model=x&base_url=http://localhost:1/v1"

    result = roboirg("run", "--plan", "paper", "--policy", model, "--dry-run")

    words = " ".join(result.out.split())
    episodes = 11 * 150 + 3 * 11 * 300 + 7 * 300
    assert "150 + 150" in words
    assert f"{episodes:,} episodes, 0 already stored. Workers: one per core" in words
    assert "least calls of models" in words


def test_a_dry_run_counts_model_calls_only_for_episodes_that_are_not_stored(roboirg, tmp_path):
    """One of three is stored; a listener asks its model once an episode: 2."""
    model = "p=vlm-listener:openai?model=x&base_url=http://localhost:1/v1"
    played = make_plan([model], tasks="PickXtimes", settings="direct", episodes="1").jobs()
    store(tmp_path, [make_record(job, "success") for job in played])
    words = ("--tasks", "PickXtimes", "--settings", "direct", "--episodes", "3", "--dry-run")

    result = roboirg("run", "--policy", model, *words, "--out", tmp_path)

    assert re.search(r"p\W+direct\W+2\W", result.out)


def test_a_run_needs_an_output_folder(roboirg):
    refused = roboirg(*RUN_RANDOM)

    assert (refused.code, "No folder given" in refused.err) == (2, True)


@pytest.mark.parametrize(
    ("words", "caption"),
    [
        (("--settings", "explicit"), "episodes"),
        (("--settings", "direct", "--forms", "both"), "episodes: implicit + resolved"),
    ],
)
def test_a_dry_run_names_the_forms_of_instructions_whose_episodes_it_counts(
    roboirg, tmp_path, words, caption
):
    result = roboirg(*RUN_RANDOM, *words, "--dry-run", "--out", tmp_path / "out")
    assert caption in map(str.strip, result.out.splitlines())


def check_refused_before_and_in_a_run(roboirg, out, sentence, *words):
    """Assert that a dry run and the run itself refuse a folder or plan in the same words."""
    dry = roboirg(*RUN_RANDOM, *words, "--out", out, "--dry-run")

    assert (dry.code, dry.err.count("\n")) == (2, 1)
    assert sentence in dry.err
    assert roboirg(*RUN_RANDOM, *words, "--out", out) == dry


def test_a_run_until_decided_of_one_setting_is_refused_before_and_in_a_run(roboirg, tmp_path):
    sentence = "stop has nothing to compare"
    words = ("--settings", "direct", "--until-decided")
    check_refused_before_and_in_a_run(roboirg, tmp_path / "out", sentence, *words)


@pytest.mark.parametrize("below", ["", "/deep/er"])
def test_a_file_is_refused_as_an_output_folder(roboirg, tmp_path, below):
    """The output folder is a file, or would be below one; neither can be made, and nothing is."""
    file = tmp_path / "file"
    file.write_text("x")

    check_refused_before_and_in_a_run(roboirg, f"{file}{below}", f"{file} is not a folder")

    assert list(tmp_path.iterdir()) == [file]


def test_a_folder_with_records_of_another_version_of_words_is_refused(roboirg, tmp_path):
    (job,) = make_plan(["random"], tasks="PickXtimes", settings="direct", episodes="1").jobs()
    store(tmp_path, [make_record(job, "success", language_version="1.1")])

    check_refused_before_and_in_a_run(roboirg, tmp_path, "language version is 1.1")


@pytest.mark.usefixtures("play_without_simulator")
def test_the_plan_that_a_run_has_written_plays_the_same_run_again(roboirg, tmp_path):
    """A run whose options are not the usual ones, on the command line and in a plan file, writes
    its plan as plan.json. A run from that file alone has the same plan. The fixture has all
    episodes succeed without a simulator."""
    plan = plan_file(
        policies=["random"], tasks="PickXtimes", settings="contextual,direct", stages="1,5;1-5",
        wordings="train", retry_on="none", frame="camera",
    )  # fmt: skip
    first = tmp_path / "first"
    again = tmp_path / "again"

    roboirg("run", "--plan", plan, "--episodes", "3,", "--forms", "both", "--out", first)
    roboirg("run", "--plan", first / "plan.json", "--out", again)

    assert read_plan(again) == read_plan(first)
    assert (again / "records.jsonl").exists()


class Wanderer(CannedPlayer):
    """Changes the working directory, as a policy in the command's own process may."""

    away = Path()

    def __call__(self, job):
        os.chdir(self.away)
        return super().__call__(job)


def test_a_relative_output_folder_stays_the_same_although_a_policy_changes_directory(
    roboirg, tmp_path, monkeypatch
):
    """The command is called in the folder "home" with the output folder "mine". A policy, stood in
    for by `Wanderer`, changes to "away" at each episode; all records must be in "home/mine"."""
    home = tmp_path / "home"
    away = tmp_path / "away"
    home.mkdir()
    away.mkdir()
    monkeypatch.chdir(home)
    monkeypatch.setattr("roboirg.runs.run.runner.EpisodeRunner", Wanderer)
    monkeypatch.setattr(Wanderer, "away", away)

    result = roboirg(*RUN_TEN_EPISODES, "mine")

    assert result.code == 0, result.err
    assert (home / "mine" / "records.jsonl").exists()
    assert list(away.iterdir()) == []


@pytest.mark.usefixtures("play_without_simulator")
def test_a_run_deletes_the_unfinished_videos_of_one_that_died_and_no_other_file(roboirg, tmp_path):
    """A video is written as ".NAME.mp4.part" and gets its name at the end. A finished video, a file
    with another ending and a folder with that of a part must stay."""
    videos = tmp_path / "videos"
    videos.mkdir()
    for name in (".a.mp4.part", "b.mp4", ".c.mp4.part.keep"):
        (videos / name).write_bytes(b"x")
    (videos / ".d.mp4.part").mkdir()  # not ours

    roboirg(*RUN_TEN_EPISODES, tmp_path)

    assert {path.name for path in videos.iterdir()} == {"b.mp4", ".c.mp4.part.keep", ".d.mp4.part"}


def test_help_groups_the_many_options_of_run_in_four_panels(roboirg, monkeypatch):
    """A panel is a frame, which begins with "╭─ " and its title; each of its options begins a line
    with "--". In a terminal of 80 columns a reader sees two to nine of them at once. The output of
    the test is no terminal, so there are no colors, whose codes begin with "\\x1b"."""
    monkeypatch.setenv("COLUMNS", "80")

    out = roboirg("run", "--help").out

    _, *panels = out.split("╭─ ")
    numbers_of_options = [panel.count("\n│ --") for panel in panels]
    assert len(panels) == 4
    assert min(numbers_of_options) >= 2
    assert max(numbers_of_options) <= 9
    assert "\x1b" not in out


def test_progress_in_a_pipe_is_plain_lines_even_if_colors_are_forced(monkeypatch, capsys):
    """The work begins at 0 s with 3 of 10 records, and the clock then reads 20, 60, 65, 100 and 101
    s. At 60 s 2 more are done, 30 s each: the other five take 150 s, over 2 minutes. At 65 s it is
    too soon for another line. At 100 s it is 6 more, in 17 s each, which the last one takes."""
    monkeypatch.setenv("FORCE_COLOR", "1")
    times = iter([0, 20, 60, 65, 100, 101])
    monkeypatch.setattr(progress_bar, "time", SimpleNamespace(monotonic=times.__next__))

    with progress_bars() as report:
        for done in (3, 5, 6, 9):
            report("record", done, 10, "")
        report("record", 10, 10, "done")

    assert not progress_console().is_terminal
    assert capsys.readouterr().err.splitlines() == [
        "record 3/10", "record 5/10 2 min left", "record 9/10 17 s left", "record 10/10  done",
    ]  # fmt: skip
