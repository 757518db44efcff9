"""The commands: what they print, and what they say of bad input."""

import math
import re

import pytest
from plan_files import plan_file
from pyarrow import parquet

from roboirg.apps.demonstrations import dataset_replay
from roboirg.apps.demonstrations.dataset_replay import ReplayResult
from roboirg.language import instruct
from roboirg.tasks.splits.splits import get_episode


def within(**choices):
    """Return words that name a plan with these choices of an export."""
    return "--plan", plan_file(tasks="StopCube", episodes=9, demonstrations=choices)


FEW = ("--tasks", "PickXtimes", "--episodes", "2", "--settings", "explicit,direct")


@pytest.mark.parametrize(
    ("choices", "size"),
    [
        ({}, "2 trajectories, 4 episodes\n"),
        ({"variations": 3, "disturbed": True}, "6 trajectories, 12 episodes\n"),
        ({"policy": "policy_lying_here:Own"}, "4 trajectories, 4 episodes\n"),
    ],
)
def test_a_dry_run_says_how_big_it_gets_and_writes_nothing(
    roboirg, tmp_path, monkeypatch, choices, size
):
    """`FEW` asks for two episodes of one task in two settings: 2 trajectories, 4 episodes.

    Three variations make three times as many; a policy of one's own hears the words, so it has a
    trajectory for each setting. The policy is a class in the current folder.
    """
    own = "from roboirg.policies.builtin.random_policy import RandomPolicy as Own\n"
    (tmp_path / "policy_lying_here.py").write_text(own)
    monkeypatch.chdir(tmp_path)
    before = sorted(tmp_path.rglob("*"))

    code, out, err = roboirg("export", "demonstrations", *FEW, *within(**choices), "--dry-run")

    assert (code, out) == (0, "")
    assert err == size
    assert sorted(tmp_path.rglob("*")) == before


def test_an_export_without_a_folder_is_refused(roboirg):
    code, _, err = roboirg("export", "demonstrations", *FEW)
    assert (code, err) == (2, "roboirg: No folder given; name one with --out, such as data.\n")


def test_an_export_tells_its_progress_and_its_end(roboirg, tmp_path, synthetic):
    """One of two synthetic episodes fails; the other one is written in two settings."""
    root = tmp_path / "data"

    code, out, err = roboirg("export", "demonstrations", *FEW, "--workers", "0", "--out", root)

    assert code == 0
    assert "record 2/2" in err
    assert "write 1/1" in err
    assert "2 episodes" in out
    assert "1 success, 1 failure" in out
    assert (root / "meta/info.json").exists()


@pytest.mark.parametrize(
    ("format", "frames"), [("lerobot-v3", "left out"), ("robomme-hdf5", "come before the policy")]
)
def test_robomme_s_format_has_the_video(roboirg, tmp_path, synthetic, format, frames):  # noqa: A002
    """The card says what becomes of the frames of the video: LeRobot's formats leave them out."""
    root = tmp_path / "data"
    words = (*FEW, "--tasks", "VideoUnmask", "--format", format, "--workers", "0", "--out", root)

    assert roboirg("export", "demonstrations", *words)[0] == 0
    assert f" {frames}" in (root / "README.md").read_text()


@pytest.fixture
def export_one_episode(roboirg, tmp_path, synthetic):
    """Export an episode of PickXtimes in all settings, with more options of the command.

    Returns:
        the folder, and what the command prints as warnings and progress.
    """

    def export(*options):
        root = tmp_path / "data"
        words = ("--tasks", "PickXtimes", "--episodes", "1", "--settings", "all", "--workers", "0")
        code, _, err = roboirg("export", "demonstrations", *words, *options, "--out", root)
        assert code == 0, err
        return root, err

    return export


@pytest.mark.parametrize(
    ("options", "pool"),
    [
        (("--split", "val"), "train"),
        (("--split", "val", "--plan", plan_file(wordings="test")), "test"),
    ],
)
def test_recordings_speak_the_words_for_training_unless_the_plan_says_others(
    export_one_episode, options, pool
):
    """A pool is a set of wordings; in evaluation, a split has the pool of its name.

    Demonstrations are for training, so their words are those of train in any split.
    """
    root, _ = export_one_episode(*options)

    rows = parquet.read_table(root / "meta/demonstrations.parquet").to_pylist()
    assert rows
    for row in rows:
        episode = get_episode(row["task"], row["split"], row["episode"])
        assert row["text"] == instruct(episode, row["setting"], wordings=pool).text
    assert f"wordings of the pool {pool!r}" in (root / "README.md").read_text()


@pytest.mark.parametrize(
    ("options", "warnings"),
    [
        (("--split", "val"), []),
        (("--split", "test"), ["episodes that it has seen"]),
        (("--split", "random", "--plan", plan_file(wordings="test")), ["words held out"]),
        (
            ("--split", "test", "--plan", plan_file(wordings="test")),
            ["episodes that it has seen", "words held out"],
        ),
    ],
)
def test_an_export_of_test_episodes_or_of_the_words_of_test_is_warned_of(
    export_one_episode, options, warnings
):
    """A policy that is trained on them has seen what the evaluation holds back."""
    _, printed = export_one_episode(*options)

    assert re.findall("episodes that it has seen|words held out", printed) == warnings


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (within(cameras=["top"]), "There is no camera 'top'"),
        (within(cameras="front"), "demonstrations.cameras is 'front'; "),
        (("--format", "lerobot-v2"), "There is no format 'lerobot-v2'; known: lerobot-v3,"),
        (within(video="first"), "demonstrations.video is 'first'; it must be a bool"),
        (("--split", "random", "--episodes", "all"), "say how many with --episodes"),
        (within(policy="oracel"), "Did you mean 'oracle'?"),
        (within(variation=2), "Did you mean 'variations'?"),
        (
            ("--plan", plan_file(demonstrations=3)),
            "demonstrations of the plan is 3; it must",
        ),
    ],
)
def test_bad_input_is_one_sentence(roboirg, tmp_path, words, message):
    """Each has one mistake in a command or plan; the exit code is 2 and one line is printed."""
    code, out, err = roboirg("export", "demonstrations", *FEW, *words, "--out", tmp_path / "data")
    assert (code, out) == (2, "")
    assert message in err
    assert err.count("\n") == 1


@pytest.mark.usefixtures("in_this_process")
def test_a_replay_prints_what_deviates(roboirg, export, monkeypatch):
    """Of four trajectories, one fails in the replay, one differs by 0.25 and one has no end state.

    Replays are made up: 0.0 for episode 0, a failure with 0.5 for 2, 0.25 for 3, and NaN for 4,
    whose dataset does not say how it ended. So three agree in the verdict, and one of them also in
    the final state.
    """
    root = export(tasks=("PickXtimes",), episodes=(0, 2, 3, 4))

    def replay(recorded):
        # The last one's dataset does not say how it ended.
        final = {0: 0.0, 2: 0.5, 3: 0.25, 4: math.nan}[recorded.index]
        status = "failure" if recorded.index == 2 else "success"
        return ReplayResult(recorded.name, status, "success", 3, 6, final, final)

    monkeypatch.setattr(dataset_replay, "replay", replay)

    code, out, _ = roboirg("replay", root)

    assert code == 2
    assert "PickXtimes/train/2/0: failure after 3 of 6 steps (recorded: success)" in out
    assert (
        "4 trajectories: 3 with the same verdict, 1 also with a final state within 0.0001 "
        "(largest difference 0.5)"
    ) in out


def test_a_folder_without_a_data_set_cannot_be_replayed(roboirg, tmp_path):
    code, _, err = roboirg("replay", tmp_path)
    assert code == 2
    assert "holds no dataset" in err
