"""The runner with the real world: what the fakes cannot show."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from pathlib import Path

import pytest
from evaluation_fakes import comparable

from roboirg.evaluation.plan.stored_plans import read_plan
from roboirg.evaluation.records.episode_log import log_path
from roboirg.evaluation.records.store import RECORDS_FILE, read_records

pytestmark = pytest.mark.sim

BROKEN = """
import numpy as np

class Broken:
    cameras = ()
    def reset(self, instruction, demonstration): self.calls = 0
    def act(self, observation):
        self.calls += 1
        return np.zeros((3, 8)) if self.calls == 1 else np.full((1, 8), np.nan)
"""


LOUD = """
import os
import numpy as np

class Loud:
    cameras = ()
    def __init__(self, seed=0): print("made")
    def reset(self, instruction, demonstration): print("told:", instruction)
    def act(self, observation):
        os.write(2, b"asked\\n")
        if observation["joint_positions"].sum() > 1e9: return None
        return np.tile(np.append(observation["joint_positions"], 1.0), (10, 1))

class Deadly(Loud):
    def act(self, observation):
        print("my last words")
        os.kill(os.getpid(), 11)
"""


def command(*words: object, cwd: Path, **environment: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-m", "roboirg", *map(str, words)],
        cwd=cwd,
        env=os.environ | environment,
        capture_output=True,
        text=True,
        check=False,
    )


def test_an_invalid_action_is_recorded_and_told(tmp_path: Path) -> None:
    (tmp_path / "mine.py").write_text(BROKEN)
    words = ("--policy", "mine:Broken", "--episodes", "1", "--settings", "explicit")
    said = command("run", *words, "--out", "out", "--workers", "1", cwd=tmp_path)
    assert said.returncode == 2
    assert said.stderr.count("\n") == 1
    assert "invalid action: " in said.stderr
    for record in read_records(tmp_path / "out"):
        assert (record.outcome, record.steps) == ("error", 3)


def test_what_policies_print_goes_to_a_log_of_each_episode(tmp_path: Path) -> None:
    (tmp_path / "mine.py").write_text(LOUD)
    words = ("--policy", "mine:Loud,mine:Deadly", "--tasks", "PickXtimes", "--settings", "direct")
    told = command(
        "run", *words, "--episodes", "2", "--max-steps", "20", "--out", "o", "--workers", "1",
        cwd=tmp_path,
    )  # fmt: skip
    records = read_records(tmp_path / "o")
    assert len(records) == 4
    for record in records:
        log = log_path(tmp_path / "o", record.slug).read_text()
        said = f"made\ntold: {' '.join(one.text for one in record.instruction)}\n"
        end = "my last words\n" if record.policy == "mine:Deadly" else "asked\nasked\n"
        assert log == said + end
    for words_of_a_policy in ("told:", "asked", "last words"):
        assert words_of_a_policy not in told.stdout + told.stderr


def test_a_video_of_a_real_episode(tmp_path: Path) -> None:
    words = ("--policy", "oracle", "--tasks", "VideoUnmask", "--settings", "direct")
    said = command("run", *words, "--episodes", "1", "--video", "all", "--out", "o", cwd=tmp_path)
    assert said.returncode == 0, said.stderr
    (record,) = read_records(tmp_path / "o")
    assert record.outcome == "success"
    assert record.demonstration_steps > 0
    assert record.render_device
    assert all(event.step <= record.steps for event in record.events)
    assert (tmp_path / "o" / str(record.video)).stat().st_size > 5_000


def test_missing_vulkan_is_one_sentence_and_loses_nothing(tmp_path: Path) -> None:
    words = ("--policy", "random", "--tasks", "PickXtimes", "--settings", "explicit", "--out", "o")
    done = command("run", *words, "--episodes", "1", "--max-steps", "2", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    said = command(
        "run", *words, "--episodes", "2", "--max-steps", "2", "--video", "all",
        cwd=tmp_path, ROBOIRG_RENDER_DEVICE="cuda:63",
    )  # fmt: skip
    assert said.returncode == 2
    assert said.stderr.startswith("roboirg: The render device 'cuda:63'")
    assert said.stderr.count("\n") == 1
    assert len(read_records(tmp_path / "o")) == 1
    assert read_plan(tmp_path / "o") is not None


SMALL_RUN = (
    "run", "--policy", "forgetful", "--policy", "listener", "--tasks", "VideoUnmask",
    "--settings", "direct,contextual", "--episodes", "2",
)  # fmt: skip


def all_comparable(folder: Path) -> list[dict[str, object]]:
    records = sorted(read_records(folder), key=lambda record: record.slug)
    return [comparable(record) for record in records]


@pytest.mark.usefixtures("without_cache")
def test_equal_commands_give_equal_records(tmp_path: Path) -> None:
    played = []
    for workers in (1, 2):
        folder = tmp_path / f"by {workers}"
        said = command(
            "run", "--policy", "random,forgetful", "--tasks", "PickXtimes,VideoUnmask",
            "--settings", "direct", "--episodes", "1", "--max-steps", "80",
            "--workers", workers, "--out", folder,
            cwd=tmp_path,
        )  # fmt: skip
        assert said.returncode == 0, said.stderr
        played.append((read_plan(folder), all_comparable(folder)))
    assert len(played[0][1]) == 4
    assert all(record["end_state"] for record in played[0][1])
    assert played[0] == played[1]


def kill_in_the_middle(folder: Path, *words: str) -> None:
    """Begin the small run and SIGKILL it when two of its eight records are there."""
    child = subprocess.Popen([sys.executable, "-m", "roboirg", *words], stdout=subprocess.DEVNULL)
    path, deadline = folder / RECORDS_FILE, time.monotonic() + 300
    while not path.exists() or path.read_bytes().count(b"\n") < 2:
        assert child.poll() is None
        assert time.monotonic() < deadline
        time.sleep(0.02)
    child.kill()
    child.wait()


@pytest.mark.usefixtures("without_cache")
@pytest.mark.slow
def test_workers_and_kills_leave_no_trace_in_the_records(tmp_path: Path) -> None:
    folders = [tmp_path / name for name in ("one", "two", "killed")]
    words = [
        (*SMALL_RUN, "--workers", str(min(number, 2)), "--out", str(folder))
        for number, folder in enumerate(folders, start=1)
    ]
    kill_in_the_middle(folders[2], *words[2])
    assert 2 <= len(read_records(folders[2])) <= 8  # a busy machine may be done before the kill
    for run in words:
        said = command(*run, cwd=tmp_path)
        assert said.returncode == 0, said.stderr
    one, two, killed = map(all_comparable, folders)
    assert len(one) == 8
    assert {record["outcome"] for record in one} == {"success", "failure"}
    assert two == one
    assert killed == one
