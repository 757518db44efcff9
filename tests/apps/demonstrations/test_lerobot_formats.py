"""LeRobot's formats: every frame of an export is what was recorded."""

import io
import json

import av
import numpy as np
import pandas as pd
import pytest
import synthetic_trajectories as synthetic
from PIL import Image
from pyarrow import parquet

from roboirg.apps.demonstrations.dataset_reading import read_dataset
from roboirg.language import instruct
from roboirg.tasks.splits.splits import get_episode
from roboirg.util.media import scaled_square

CAMERAS = ("front", "wrist")
WRIST = "observation.images.wrist"


def read_json(path):
    return json.loads(path.read_text())


def frames_of(path):
    with av.open(str(path)) as container:
        return [frame.to_ndarray(format="rgb24") for frame in container.decode(video=0)]


def decoded(entry):
    return np.asarray(Image.open(io.BytesIO(entry["bytes"])))


def load_v3(root):
    """Read a dataset of version 3 as LeRobot does: by its own metadata."""
    info = read_json(root / "meta/info.json")
    episodes = parquet.read_table(root / "meta/episodes/chunk-000/file-000.parquet").to_pylist()
    for row in episodes:
        place = {"chunk_index": row["data/chunk_index"], "file_index": row["data/file_index"]}
        frames = parquet.read_table(root / info["data_path"].format(**place)).to_pylist()
        yield row, [one for one in frames if one["episode_index"] == row["episode_index"]]


def check_statistics(root):
    """Assert that they are those of all frames."""
    stats = read_json(root / "meta/stats.json")
    frames = [frame for _, own in load_v3(root) for frame in own]
    for name in ("observation.state", "action", "index", "next.success"):
        values = np.array([np.atleast_1d(frame[name]) for frame in frames], dtype=float)
        for what in ("min", "max", "mean", "std"):
            assert np.allclose(stats[name][what], getattr(values, what)(axis=0))
        assert np.allclose(stats[name]["q99"], np.quantile(values, 0.99, axis=0))
        assert stats[name]["count"] == [len(frames)]
    name = "observation.images.wrist"
    pixels = np.stack([decoded(frame[name]) for frame in frames]).reshape(-1, 3) / 255.0
    assert np.ravel(stats[name]["mean"]) == pytest.approx(pixels.mean(axis=0))
    assert np.ravel(stats[name]["q01"]) == pytest.approx(np.quantile(pixels, 0.01, axis=0))
    for row, own in load_v3(root):
        state = np.array([frame["observation.state"] for frame in own])
        assert np.allclose(row["stats/observation.state/max"], state.max(axis=0))
    assert set(stats) == set(read_json(root / "meta/info.json")["features"]) - {
        "subgoal",
        "grounded_subgoal",
    }


def test_every_frame_of_version_3_is_as_recorded_and_counted_in_statistics(export):
    root = export()
    info, index = read_json(root / "meta/info.json"), 0
    facts = pd.read_parquet(root / "meta/demonstrations.parquet").set_index("episode_index")
    tasks = pd.read_parquet(root / "meta/tasks.parquet")
    assert (info["fps"], info["codebase_version"]) == (20, "v3.0")
    assert None not in [one["names"] for one in info["features"].values()]
    for row, frames in load_v3(root):
        number = row["episode_index"]
        told = facts.loc[number]
        episode = get_episode(told.task, told.split, int(told.episode))
        assert told.text == instruct(episode, told.setting, told.form).text == row["tasks"][0]
        assert told.explicit == instruct(episode).text
        assert row["length"] == len(frames) == synthetic.STEPS
        assert (row["dataset_from_index"], row["dataset_to_index"]) == (index, index + len(frames))
        expected = synthetic.arrays_of(episode, len(frames) + 1, 0, has_depth=False)
        for time, frame in enumerate(frames):
            assert frame["index"] == index
            assert frame["frame_index"] == time
            assert frame["timestamp"] == pytest.approx(time / 20, abs=1e-6)
            assert tasks.iloc[frame["task_index"]].name == told.text
            state = [*expected["joint_positions"][time], expected["gripper"][time, 0]]
            assert frame["observation.state"] == state
            action = expected["actions"][time + 1]
            assert frame["action"] == action.tolist()
            assert frame["pose_action"] == pytest.approx(expected["pose_actions"][time + 1])
            assert frame["subgoal"] == expected["subgoals"][time + 1]
            assert frame["next.done"] == frame["next.success"] == (time == len(frames) - 1)
            assert frame["next.reward"] == float(time == len(frames) - 1)
            assert not frame["is_video_demo"]
            for camera in CAMERAS:
                picture = decoded(frame[f"observation.images.{camera}"])
                assert np.array_equal(picture, synthetic.picture(camera, episode.seed, time))
            index += 1
    assert (info["total_frames"], info["total_tasks"]) == (index, len(tasks))
    assert info["splits"] == {"train": f"0:{info['total_episodes']}"}
    # Two tasks and settings; episode 1 of each task fails.
    assert info["total_episodes"] == len(facts) == 8
    assert set(info["features"]) == set(frame)
    check_statistics(root)
    # Pictures of two settings are stored once.
    (both, one) = (
        sum(path.stat().st_size for path in (root / "data").rglob("*.parquet"))
        for root in (root, export("one", settings=("explicit",)))
    )
    assert both < 1.3 * one


@pytest.mark.parametrize(
    ("version", "pictures"), [("lerobot-v3", "png"), ("lerobot-v2.1", "lossless-video")]
)
def test_one_camera_in_small_pictures(export, version, pictures):
    root = export(
        cameras=("wrist",), size=96, pictures=pictures, format=version, settings=("explicit",)
    )
    info, stats = read_json(root / "meta/info.json"), read_json(root / "meta/stats.json")
    shown = [name for name in info["features"] if "images" in name]
    assert shown == [name for name in stats if "images" in name] == [WRIST]
    assert info["features"][WRIST]["shape"] == [96, 96, 3]
    assert stats[WRIST]["count"] == stats["action"]["count"] == [4 * synthetic.STEPS]
    seed = get_episode("PickXtimes", "train", 0).seed
    whole = synthetic.picture("wrist", seed, 3)
    expected = scaled_square(whole, 96)
    if pictures == "png":
        path = min((root / "data").rglob("*.parquet"))
        found = decoded(parquet.read_table(path)[WRIST].to_pylist()[3])
    else:
        found = frames_of(min(root.rglob("*.mp4")))[3]
    assert np.array_equal(found, expected)
    assert np.abs(whole.mean(axis=(0, 1)) - expected.mean(axis=(0, 1))).max() < 1
    assert "Cameras: wrist; 96 × 96 pixels." in (root / "README.md").read_text()


def test_the_video_comes_before_the_policy_and_is_marked(export):
    root = export(video=True, pictures="lossless-video", tasks=("VideoUnmask",), episodes=(0,))
    episode = get_episode("VideoUnmask", "train", 0)
    counted = read_json(root / "meta/stats.json")[WRIST]["count"]
    assert counted == [2 * (4 + synthetic.STEPS)]
    for row, frames in load_v3(root):
        assert [frame["is_video_demo"] for frame in frames] == [True] * 4 + [
            False
        ] * synthetic.STEPS
        expected = synthetic.arrays_of(episode, len(frames) + 1, 4, has_depth=False)
        assert frames[3]["action"] == expected["actions"][4].tolist()
        key = "videos/observation.images.wrist"
        assert row[f"{key}/from_timestamp"] == 0.0
        assert row[f"{key}/to_timestamp"] == pytest.approx(len(frames) / 20)
        video = frames_of(root / f"{key}/chunk-000/file-000.mp4")
        for time in range(len(frames)):
            assert np.array_equal(video[time], synthetic.picture("wrist", episode.seed, time))


def test_version_2_1_has_a_file_per_episode(export):
    root = export(format="lerobot-v2.1")
    info = read_json(root / "meta/info.json")
    episodes = [json.loads(one) for one in (root / "meta/episodes.jsonl").read_text().splitlines()]
    tasks = [json.loads(one) for one in (root / "meta/tasks.jsonl").read_text().splitlines()]
    stats = (root / "meta/episodes_stats.jsonl").read_text().splitlines()
    assert info["total_episodes"] == len(episodes) == len(stats) == 8
    assert (info["total_videos"], info["total_chunks"]) == (0, 1)
    index = 0
    facts = pd.read_parquet(root / "meta/demonstrations.parquet")
    for row in episodes:
        number = row["episode_index"]
        path = info["data_path"].format(episode_chunk=0, episode_index=number)
        frames = parquet.read_table(root / path).to_pylist()
        assert len(frames) == row["length"]
        for time, frame in enumerate(frames):
            assert tasks[frame["task_index"]]["task"] == row["tasks"][0]
            assert (frame["index"], frame["episode_index"]) == (index, number)
            shown = synthetic.picture("wrist", facts.seed[number], time)
            assert np.array_equal(decoded(frame["wrist_image"]), shown)
            index += 1
        assert {"image", "wrist_image", "state", "actions"} < set(frames[0])
    # LeRobot reads this version without saying what the columns are.
    described = json.loads(parquet.read_schema(root / path).metadata[b"huggingface"])
    types = described["info"]["features"]
    assert types["image"] == {"_type": "Image"}
    value = {"dtype": "float32", "_type": "Value"}
    assert types["actions"] == {"feature": value, "length": 8, "_type": "Sequence"}
    modality = read_json(root / "meta/modality.json")
    assert modality["state"]["gripper"] == {"start": 7, "end": 8, "original_key": "state"}


@pytest.mark.parametrize("version", ["lerobot-v3", "lerobot-v2.1"])
def test_actions_are_read_back_once_per_trajectory(export, version):
    root = export(format=version, video=True)
    found = list(read_dataset(root))
    assert [(one.task, one.index) for one in found] == [
        ("PickXtimes", 0),
        ("PickXtimes", 2),
        ("VideoUnmask", 0),
        ("VideoUnmask", 2),
    ]
    for one in found:
        video = 4 * (one.task == "VideoUnmask")
        episode, rows = get_episode(one.task, "train", one.index), video + 1 + synthetic.STEPS
        expected = synthetic.arrays_of(episode, rows, video, has_depth=False)
        assert np.array_equal(one.actions, expected["actions"][video + 1 :])
        assert np.array_equal(one.states[:, :7], expected["joint_positions"][video + 1 :])
        assert np.array_equal(one.final_state[7:], expected["gripper"][-1])
