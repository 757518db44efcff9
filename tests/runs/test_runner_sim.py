"""The runner with the real world: what the fakes cannot show."""

import pytest
from page_text import call
from python_process import run_python
from run_fakes import all_comparable

from roboirg.core.errors import RenderDeviceError
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
        return np.zeros((3, 8)) if self.calls == 1 else np.full((1, 8), np.nan)
"""


@pytest.fixture(scope="module")
def run_of_loud_policy(tmp_path_factory):
    """The process of a run of one episode by `CODE_OF_A_POLICY_THAT_PRINTS`, and its folder."""
    folder = tmp_path_factory.mktemp("loud")
    (folder / "mine.py").write_text(CODE_OF_A_POLICY_THAT_PRINTS)
    words = ("--policy", "mine:Loud", "--tasks", "PickXtimes", "--settings", "direct")
    process = run_python(
        "-m", "roboirg", "run", *words, "--episodes", "1", "--out", "o", "--workers", "1",
        cwd=folder,
    )  # fmt: skip
    return process, folder / "o"


def test_an_invalid_action_is_an_error_in_one_sentence(run_of_loud_policy):
    """The policy of the run answers with actions for three steps, and then with nan, no number.

    The command ends with the status 2, for errors, and prints one line about it.
    """
    process, folder = run_of_loud_policy

    (record,) = read_records(folder)

    assert (record.outcome, record.steps) == ("error", 3)
    assert (process.returncode, process.stderr.count("\n")) == (2, 1)
    assert "invalid action: " in process.stderr


def test_what_a_policy_prints_goes_to_its_log_and_not_to_the_terminal(run_of_loud_policy):
    """The policy of the run prints "made" when it is made and "told:" with the instruction when an
    episode begins. It writes "asked" to its standard error in each of its two calls: it answers for
    three steps, then with an invalid action, which ends the episode."""
    process, folder = run_of_loud_policy

    (record,) = read_records(folder)

    told = " ".join(turn.text for turn in record.instruction)
    log = log_path(folder, record.slug).read_text()
    assert log == f"made\ntold: {told}\nasked\nasked\n"
    assert "told:" not in process.stdout + process.stderr
    assert "asked" not in process.stdout + process.stderr


def run_with_videos(folder, episodes):
    """Run some episodes, of nine steps each, and keep videos of all."""
    call(
        "run", "--policy", "random", "--tasks", "PickXtimes", "--settings", "explicit",
        "--max-steps", "9", "--video", "all", "--out", folder, "--episodes", episodes,
        "--workers", "1",
    )  # fmt: skip


@pytest.fixture(scope="module")
def folder_of_one_episode(tmp_path_factory):
    folder = tmp_path_factory.mktemp("one episode")
    run_with_videos(folder, episodes=1)
    return folder


def test_a_record_has_the_device_that_drew_the_episode_and_its_video(folder_of_one_episode):
    """The video shows nine steps, which take some thousand bytes; a file without frames has fewer
    than 2,000."""
    (record,) = read_records(folder_of_one_episode)

    assert record.render_device
    assert (folder_of_one_episode / record.video).stat().st_size > 2_000


def test_a_render_device_that_is_not_there_ends_the_run_and_keeps_what_was_played(
    folder_of_one_episode, monkeypatch
):
    """One of two episodes was played. Then a variable tells to draw on the 64th graphics card
    (their numbers begin with 0), which no machine has: the run ends with an error that names it."""
    played = read_records(folder_of_one_episode)
    monkeypatch.setenv("ROBOIRG_RENDER_DEVICE", "cuda:63")

    with pytest.raises(RenderDeviceError, match=r"^The render device 'cuda:63'"):
        run_with_videos(folder_of_one_episode, episodes=2)

    assert read_records(folder_of_one_episode) == played
    assert read_plan(folder_of_one_episode) is not None


def run_two_policies(folder, workers):
    """Run two policies for 40 steps each, and return the plan and the records, without times."""
    call(
        "run", "--policy", "random,forgetful", "--tasks", "VideoUnmask", "--settings", "direct",
        "--episodes", "1", "--max-steps", "40", "--workers", workers, "--out", folder,
    )  # fmt: skip
    return read_plan(folder), all_comparable(folder)


@pytest.mark.usefixtures("without_cache")
def test_the_same_command_gives_the_same_records_with_and_without_a_worker_process(tmp_path):
    """Without one (0) the episodes are played in the process of the command itself.

    What is compared has something to differ in: two policies act, after a video was shown to them,
    and a record has the state of the simulator in which its episode ended.
    """
    here = run_two_policies(tmp_path / "here", workers=0)
    in_a_worker = run_two_policies(tmp_path / "in a worker", workers=1)

    assert here == in_a_worker
    records = read_records(tmp_path / "here")
    assert [record.policy for record in records] == ["random", "forgetful"]
    for record in records:
        assert record.end_state
        assert record.demonstration_steps > 0
        assert all(event.step <= record.steps for event in record.events)
