"""The runner with the real world: what the fakes cannot show."""

import os
import subprocess
import sys

import pytest
from run_fakes import all_comparable
from typer.testing import CliRunner

from roboirg.main import app
from roboirg.records.episode_log import log_path
from roboirg.records.store import read_records
from roboirg.runs.plan.stored_plans import read_plan

pytestmark = pytest.mark.sim

CODE_OF_A_POLICY_THAT_PRINTS = """
import os
import numpy as np

class Loud:
    cameras = ()
    def __init__(self, seed=0):
        print("made")
        self.calls = 0
    def reset(self, instruction, demonstration): print("told:", instruction)
    def act(self, observation):
        os.write(2, b"asked\\n")
        self.calls += 1
        if observation["joint_positions"].sum() > 1e9: return None
        return np.zeros((3, 8)) if self.calls == 1 else np.full((1, 8), np.nan)
"""


def run_in_a_process(*words, cwd, **environment):
    return subprocess.run(
        [sys.executable, "-m", "roboirg", *map(str, words)],
        cwd=cwd,
        env=os.environ | environment,
        capture_output=True,
        text=True,
        check=False,
    )


def run_here(*words):
    return CliRunner().invoke(app, ["run", *map(str, words)])


@pytest.fixture(scope="module")
def invalid_action(tmp_path_factory):
    """The process of a run of one episode by `CODE_OF_A_POLICY_THAT_PRINTS`, and its folder.

    The policy acts for three steps, then returns an invalid action.
    """
    folder = tmp_path_factory.mktemp("invalid action")
    (folder / "mine.py").write_text(CODE_OF_A_POLICY_THAT_PRINTS)
    words = ("--policy", "mine:Loud", "--tasks", "PickXtimes", "--settings", "direct")
    process = run_in_a_process(
        "run", *words, "--episodes", "1", "--out", "o", "--workers", "1", cwd=folder
    )
    return process, folder / "o"


def test_an_invalid_action_is_an_error_in_one_sentence(invalid_action):
    process, folder = invalid_action

    (record,) = read_records(folder)

    assert (record.outcome, record.steps) == ("error", 3)
    assert process.returncode == 2
    assert process.stderr.count("\n") == 1
    assert "invalid action: " in process.stderr


def test_what_a_policy_prints_goes_to_its_log_and_not_to_the_terminal(invalid_action):
    process, folder = invalid_action

    (record,) = read_records(folder)

    told = " ".join(turn.text for turn in record.instruction)
    log = log_path(folder, record.slug).read_text()
    assert log == f"made\ntold: {told}\nasked\nasked\n"
    printed = process.stdout + process.stderr
    assert "told:" not in printed
    assert "asked" not in printed


def test_a_render_device_that_is_not_there_ends_the_run_and_keeps_what_was_played(
    tmp_path, monkeypatch
):
    words = ("--policy", "random", "--tasks", "PickXtimes", "--settings", "explicit",
             "--max-steps", "9", "--video", "all", "--out", tmp_path / "o",
             "--episodes")  # fmt: skip
    done = run_here(*words, "1", "--workers", "0")
    assert done.exit_code == 0, done.output

    (record,) = read_records(tmp_path / "o")
    assert record.render_device
    assert (tmp_path / "o" / str(record.video)).stat().st_size > 2_000

    monkeypatch.setenv("ROBOIRG_RENDER_DEVICE", "cuda:63")
    said = run_here(*words, "2", "--workers", "1")
    assert str(said.exception).startswith("The render device 'cuda:63'")
    assert read_records(tmp_path / "o") == (record,)
    assert read_plan(tmp_path / "o") is not None


@pytest.mark.usefixtures("without_cache")
def test_the_same_command_gives_the_same_records_with_and_without_a_worker_process(tmp_path):
    played = []
    for workers in (0, 1):
        folder = tmp_path / f"by {workers}"
        done = run_here(
            "--policy", "random,forgetful", "--tasks", "VideoUnmask", "--settings", "direct",
            "--episodes", "1", "--max-steps", "40", "--workers", workers, "--out", folder,
        )  # fmt: skip
        assert done.exit_code == 0, done.output
        played.append((read_plan(folder), all_comparable(folder)))
    assert played[0] == played[1]

    records = read_records(folder)
    assert {record.policy for record in records} == {"random", "forgetful"}
    for record in records:
        assert record.end_state
        assert record.demonstration_steps > 0
        assert all(event.step <= record.steps for event in record.events)
