"""100 demonstrations of a real study, written by LeRobot's own recorder: checked and converted.

`make integrations` runs this with LeRobot's own environment.
"""

import csv
import sys

import numpy as np
import pytest

pytest.importorskip("lerobot", reason="LeRobot is not installed here; run `make integrations`")

from lerobot.datasets.lerobot_dataset import LeRobotDataset

from roboirg import main as cli

NAMES = [*(f"joint_{number}.pos" for number in range(1, 8)), "gripper.pos"]
FRAMES = 6


def call(*words):
    """Call the command; returns its exit code."""
    sys.argv = ["roboirg", *map(str, words)]
    try:
        cli.main()
    except SystemExit as left:
        return left.code or 0
    return 0


@pytest.fixture(scope="module")
def study(tmp_path_factory):
    folder = tmp_path_factory.mktemp("study") / "plan"
    assert call("real", "plan", "--policy", "listener", "--out", folder) == 0
    return folder


@pytest.fixture(scope="module")
def rows(study):
    found = list(csv.DictReader((study / "demonstrations.csv").open()))
    assert len(found) == 100
    return found


def shown(camera, episode, frame):
    """Return a picture of one color."""
    base = 30 if camera == "front" else 90
    return np.full((96, 128, 3), (base + 20 * frame, 2 * episode, base), np.uint8)


def vectors(episode):
    """Return states and actions: joints (rad) and the gripper, 0 to 1."""
    rng = np.random.default_rng(episode)
    found = rng.uniform(-1, 1, (2, FRAMES, 8))
    found[:, :, 7] = (found[:, :, 7] + 1) / 2
    return found.astype(np.float32)


def record(root, texts, cameras=("front", "wrist"), videos=False):
    """Record one episode for each text, as `lerobot-record` does."""
    features = {
        name: {"dtype": "float32", "shape": (8,), "names": NAMES}
        for name in ("observation.state", "action")
    }
    for camera in cameras:
        features[f"observation.images.{camera}"] = {
            "dtype": "video" if videos else "image",
            "shape": (96, 128, 3),
            "names": ["height", "width", "channels"],
        }
    made = LeRobotDataset.create(
        "lab/study", 20, features, root=root, robot_type="fr3", use_videos=videos
    )
    for episode, text in enumerate(texts):
        if episode == len(texts) // 2:  # as a later call of the recorder
            made.finalize()
            made = LeRobotDataset.resume("lab/study", root=root)
        states, actions = vectors(episode)
        for frame in range(FRAMES):
            pictures = {f"observation.images.{one}": shown(one, episode, frame) for one in cameras}
            made.add_frame(
                {"observation.state": states[frame], "action": actions[frame], "task": text}
                | pictures
            )
        made.save_episode()
    made.finalize()
    return root


@pytest.fixture(scope="module")
def recorded(tmp_path_factory, rows):
    root = tmp_path_factory.mktemp("recorded") / "videos"
    return record(root, [row["instruction"] for row in rows], videos=True)


def test_a_recording_as_planned_is_converted_and_lerobot_reads_it(
    study, rows, recorded, tmp_path, capsys
):
    root = tmp_path / "data"
    assert call("export", "recordings", study, recorded, "--out", root) == 0
    assert "100 demonstrations, 600 frames: as planned." in capsys.readouterr().out
    read = LeRobotDataset("local/roboirg", root=root)
    assert (read.num_episodes, read.num_frames) == (100, 100 * (FRAMES - 1))
    for index in range(read.num_frames):
        item = read[index]
        episode, frame = divmod(index, FRAMES - 1)
        states, actions = vectors(episode)
        assert item["task"] == rows[episode]["instruction"]
        assert np.allclose(item["observation.state"][:7], states[frame, :7], atol=1e-6)
        assert np.isclose(item["action"][7], 2 * actions[frame, 7] - 1, atol=1e-6)
        for camera in ("front", "wrist"):
            picture = item[f"observation.images.{camera}"].permute(1, 2, 0).numpy() * 255
            # LeRobot's recorder compresses videos with a loss, and keeps some blocks of the last.
            color = np.median(picture, axis=(0, 1))
            assert np.abs(color - shown(camera, episode, frame)[0, 0]).max() < 5
    card = (root / "README.md").read_text()
    for line in ("--batch_size=48 --steps=5000", "--policy.optimizer_lr=5e-05",
                 "--policy.scheduler_warmup_steps=300", "--policy.chunk_size=20"):  # fmt: skip
        assert line in card


def test_an_unbalanced_color_is_refused(study, rows, tmp_path, capsys):
    texts = [row["instruction"] for row in rows]
    yellow = next(one for one in texts if "yellow" in one and "once" in one)
    texts[texts.index(yellow)] = yellow.replace("yellow", "gray")
    assert call("export", "recordings", study, record(tmp_path / "recorded", texts)) == 2
    said = capsys.readouterr().err
    assert (
        "PickByCount has target_color gray 26, yellow 24; the plan has gray 25, yellow 25." in said
    )


def test_a_missing_camera_is_refused(study, rows, tmp_path, capsys):
    texts = [row["instruction"] for row in rows]
    root = record(tmp_path / "recorded", texts, cameras=("front",))
    assert call("export", "recordings", study, root, "--out", tmp_path / "data") == 2
    assert "There is no wrist camera 'wrist'; the dataset has front." in capsys.readouterr().err
    assert not (tmp_path / "data").exists()
