"""Recordings of a real study: checked against its plan, converted into the trainers' formats."""

import sys

import h5py
import numpy as np
import pandas as pd
import pytest
import teleop_recordings as recorded
from pyarrow import parquet

from roboirg import main as cli
from roboirg.core.kinematics import end_effector_pose
from roboirg.language import instruct
from roboirg.tasks.splits.splits import get_episode
from roboirg.util import processor
from roboirg.util.media import decode_png


@pytest.fixture
def rows(tmp_path):
    return recorded.write_plan(tmp_path / "study")


@pytest.fixture
def texts(rows):
    return [row["instruction"] for row in rows]


@pytest.fixture
def export(tmp_path, monkeypatch, capsys):
    """Call the command for the dataset ``recorded`` with options in its spec and words behind."""
    monkeypatch.setattr(processor, "worker_count", lambda _: 0)  # processes start slowly

    def call(options="", *words, data="recorded"):
        names = ("export", "recordings", tmp_path / "study", f"{tmp_path / data}{options}", *words)
        monkeypatch.setattr(sys, "argv", ["roboirg", *map(str, names)])
        try:
            cli.main()
            code = 0
        except SystemExit as left:
            code = left.code or 0
        return code, *capsys.readouterr()

    return call


def test_what_was_planned_passes_and_nothing_is_written(tmp_path, texts, export):
    recorded.write_recording(tmp_path / "recorded", texts)
    before = sorted(tmp_path.rglob("*"))
    assert export() == (0, "8 demonstrations, 40 frames: as planned.\n", "")
    assert sorted(tmp_path.rglob("*")) == before


def test_an_unbalanced_color_is_refused(tmp_path, rows, texts, export):
    said = {row["target_color"]: row["instruction"] for row in rows if row["task"] == "PutInBox"}
    place = texts.index(said["green"])
    texts[place] = said["purple"]
    recorded.write_recording(tmp_path / "recorded", texts)
    code, out, err = export("", "--out", tmp_path / "data")
    assert (code, out) == (2, "")
    assert "PutInBox has target_color green 1, purple 3; the plan has green 2, purple 2." in err
    assert f"{said['green']!r} " in err
    assert "PickByCount has" not in err
    assert not (tmp_path / "data").exists()


def test_a_number_that_is_missing_is_named(tmp_path, rows, texts, export):
    twice = next(index for index, row in enumerate(rows) if row["repeats"] == "2")
    recorded.write_recording(tmp_path / "recorded", texts[:twice] + texts[twice + 1 :])
    code, _, err = export()
    assert code == 2
    assert "PickByCount has repeats 1 2, 2 1; the plan has 1 2, 2 2." in err


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ("", "There is no wrist camera 'wrist'; the dataset has front, hand. Name it: "),
        ("?wrist=palm", "There is no wrist camera 'palm'"),
        ("?wrist=hand&joint=arm_{}", "observation.state has no arm_1, arm_2"),
        ("?wrist=hand&hand=wrist", "no option of dataset"),
        ("?wrist", "options are written ?name=value"),
    ],
)
def test_a_missing_camera_is_refused_until_it_is_named(tmp_path, texts, export, options, message):
    recorded.write_recording(tmp_path / "recorded", texts, cameras=("front", "hand"))
    code, _, err = export(options)
    assert code == 2
    assert message in err
    assert "Traceback" not in err
    assert export("?wrist=hand")[0] == 0


def test_another_rate_is_refused(tmp_path, texts, export):
    recorded.write_recording(tmp_path / "recorded", texts, fps=30)
    code, _, err = export()
    assert code == 2
    assert "The rate is 30 frames per second, but the study plays 20." in err


def test_units_must_be_named(tmp_path, texts, export):
    def in_degrees(values):
        return np.column_stack([np.degrees(values[:, :7]), 80 * values[:, 7]]).astype(np.float32)

    recorded.write_recording(tmp_path / "recorded", texts, unit=in_degrees)
    code, _, err = export()
    assert code == 2
    assert "Episode 0: observation.state is beyond a turn; degrees?" in err
    assert "the gripper of action is from" in export("?degrees=true")[2]
    assert export("?degrees=true&gripper_open=80")[0] == 0


def test_words_outside_the_plan_are_named(tmp_path, texts, export):
    recorded.write_recording(tmp_path / "recorded", ["Grab it.", *texts[1:]])
    code, _, err = export()
    assert code == 2
    assert "'Grab it.' 1 instead of 0 times" in err


def test_another_order_is_accepted_and_told(tmp_path, rows, texts, export):
    order = sorted(range(len(texts)), key=lambda index: texts[index])
    recorded.write_recording(tmp_path / "recorded", [texts[index] for index in order])
    code, out, _ = export("", "--out", tmp_path / "data", "--format", "lerobot-v3")
    assert code == 0
    assert "were recorded out of order" in out
    facts = pd.read_parquet(tmp_path / "data/meta/demonstrations.parquet")
    assert [int(rows[index]["episode"]) for index in order] == facts.episode.tolist()
    assert sorted(zip(facts.task, facts.episode, strict=True)) == sorted(
        (row["task"], int(row["episode"])) for row in rows
    )


@pytest.mark.parametrize("videos", [False, True], ids=["pictures", "videos"])
def test_converted_frames_are_what_was_recorded(tmp_path, rows, texts, export, videos):
    recorded.write_recording(tmp_path / "recorded", texts, videos=videos)
    root = tmp_path / "data"
    assert export("", "--out", root)[0] == 0
    facts = pd.read_parquet(root / "meta/demonstrations.parquet").set_index("episode_index")
    files = sorted(root.glob("data/*/*.parquet"))
    assert len(files) == len(rows) == len(facts)
    for number, row in enumerate(rows):
        own = facts.loc[number]
        assert (own.task, own.episode) == (row["task"], int(row["episode"]))
        assert own.text == instruct(get_episode(own.task, "train", own.episode)).text
        assert (own.policy, own.setting, own.status) == ("teleoperation", "explicit", "success")
        states, actions = (recorded.vectors(kind, number) for kind in ("state", "action"))
        frames = parquet.read_table(files[number]).to_pylist()
        assert len(frames) == recorded.FRAMES - 1  # the last action leads to no observation
        for time, frame in enumerate(frames):
            opening = states[time, 7] * 0.04
            assert frame["observation.state"] == pytest.approx([*states[time, :7], opening])
            assert frame["action"] == pytest.approx([*actions[time, :7], 2 * actions[time, 7] - 1])
            for camera in ("front", "wrist"):
                shown = decode_png(frame[f"observation.images.{camera}"]["bytes"])
                color = recorded.picture(camera, number, time)[24, 32]
                assert shown.shape == (256, 256, 3)
                assert (shown == color).all()


def test_the_other_formats_hold_it_too(tmp_path, rows, texts, export):
    recorded.write_recording(tmp_path / "recorded", texts)
    for name in ("lerobot-v2.1", "robomme-hdf5"):
        assert export("", "--out", tmp_path / name, "--format", name)[0] == 0
    first = parquet.read_table(tmp_path / "lerobot-v2.1/data/chunk-000/episode_000000.parquet")
    assert first["state"][1].as_py()[:7] == pytest.approx(recorded.vectors("state", 0)[1, :7])
    place = next(index for index, row in enumerate(rows) if row["task"] == "PutInBox")
    path = tmp_path / "robomme-hdf5/record_dataset_PutInBox.h5"
    with h5py.File(path) as file:
        episode = file[f"episode_{rows[place]['episode']}"]
        assert episode["setup/task_goal"][0].decode() == texts[place]
        step = episode["timestep_1"]  # its observation is the result of its action
        assert "front_depth" not in step["obs"]
        states, actions = (recorded.vectors(kind, place) for kind in ("state", "action"))
        assert step["obs/joint_state"][()] == pytest.approx(states[2, :7])
        assert step["action/joint_action"][()][:7] == pytest.approx(actions[1, :7])
        assert step["obs/eef_state"][:3] == pytest.approx(end_effector_pose(states[2, :7])[:3])
        assert len([name for name in episode if name.startswith("timestep")]) == 4


@pytest.mark.parametrize(
    ("name", "lines"),
    [
        (
            "lerobot-v2.1",
            ("action_horizon=20", "num_train_steps=5000, batch_size=48", "warmup_steps=300",
             "peak_lr=5e-05", "decay_lr=5e-05"),
        ),
        (
            "lerobot-v3",
            ("--policy.chunk_size=20 --policy.n_action_steps=20", "--batch_size=48 --steps=5000",
             "--policy.optimizer_lr=5e-05", "--policy.scheduler_warmup_steps=300"),
        ),
        (
            "robomme-hdf5",
            ("--num-train-steps=5000 --batch-size=48", "--lr-schedule.warmup-steps=300",
             "--lr-schedule.peak-lr=5e-05"),
        ),
    ],
)  # fmt: skip
def test_the_training_configuration_has_the_papers_numbers(tmp_path, texts, export, name, lines):
    recorded.write_recording(tmp_path / "recorded", texts)
    assert export("", "--out", tmp_path / "data", "--format", name)[0] == 0
    card = (tmp_path / "data/README.md").read_text()
    for line in lines:
        assert line in card
    assert "80000" not in card


def test_a_damaged_recording_is_named_and_the_export_goes_on_when_it_is_whole(
    tmp_path, texts, export
):
    recorded.write_recording(tmp_path / "recorded", texts, videos=True)
    video = next((tmp_path / "recorded/videos").rglob("*.mp4"))
    whole = video.read_bytes()
    video.write_bytes(whole[: len(whole) // 2])
    code, _, err = export("", "--out", tmp_path / "data")
    assert code == 2
    assert f"The video {video} cannot be read" in err
    video.write_bytes(whole)
    assert export("", "--out", tmp_path / "data")[0] == 0


def test_other_folders_are_refused_in_a_sentence(tmp_path, texts, export):
    recorded.write_recording(tmp_path / "recorded", texts)
    info = tmp_path / "recorded/meta/info.json"
    for data, message in (("nowhere", "No such file"), ("recorded", "its format is v2.1")):
        info.write_text(info.read_text().replace("v3.0", "v2.1"))
        code, _, err = export(data=data)
        assert code == 2
        assert "is no dataset of LeRobot's format v3.0" in err
        assert message in err
    info.write_text(info.read_text().replace("v2.1", "v3.0"))
    (tmp_path / "study/demonstrations.csv").unlink()
    assert "make one with roboirg real plan" in export()[2]
