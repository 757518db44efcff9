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
COLUMNS = {
    "lerobot-v3": ("observation.state", "action", "observation.images.front", WRIST),
    "lerobot-v2.1": ("state", "actions", "image", "wrist_image"),
}
"""By version: the state, the action, and the pictures of the cameras."""


def read_json(path):
    return json.loads(path.read_text())


def read_lines(path):
    return [json.loads(line) for line in path.read_text().splitlines()]


def read_rows(path):
    return parquet.read_table(path).to_pylist()


def frames_of(path):
    with av.open(str(path)) as container:
        return [frame.to_ndarray(format="rgb24") for frame in container.decode(video=0)]


def decoded(entry):
    return np.asarray(Image.open(io.BytesIO(entry["bytes"])))


def episodes_of(root):
    """Yield the row and the frames of each episode, found as LeRobot does: by the metadata."""
    info = read_json(root / "meta/info.json")
    if info["codebase_version"] == "v3.0":
        rows = read_rows(root / "meta/episodes/chunk-000/file-000.parquet")
    else:
        rows = read_lines(root / "meta/episodes.jsonl")
    for row in rows:
        number = row["episode_index"]
        path = info["data_path"].format(
            episode_chunk=0,
            episode_index=number,
            chunk_index=row.get("data/chunk_index"),
            file_index=row.get("data/file_index"),
        )
        frames = read_rows(root / path)
        yield row, [frame for frame in frames if frame["episode_index"] == number]


def texts_of(root):
    """Return the instructions in the order of their numbers."""
    path = root / "meta/tasks.jsonl"
    if path.exists():
        return [row["task"] for row in read_lines(path)]
    return list(pd.read_parquet(root / "meta/tasks.parquet").index)


@pytest.mark.parametrize("version", COLUMNS)
def test_every_frame_is_as_recorded(export, version):
    state, action, *pictures = COLUMNS[version]
    root = export(format=version)

    facts = pd.read_parquet(root / "meta/demonstrations.parquet").set_index("episode_index")
    index = 0
    for row, frames in episodes_of(root):
        told = facts.loc[row["episode_index"]]
        episode = get_episode(told.task, told.split, int(told.episode))
        expected = synthetic.arrays_of(episode, len(frames) + 1, 0, has_depth=False)
        for time, frame in enumerate(frames):
            assert (frame["index"], frame["frame_index"]) == (index, time)
            assert frame["timestamp"] == pytest.approx(time / 20, abs=1e-6)
            finger, _ = expected["gripper"][time]
            assert frame[state] == [*expected["joint_positions"][time], finger]
            assert frame[action] == expected["actions"][time + 1].tolist()
            for camera, name in zip(CAMERAS, pictures, strict=True):
                shown = synthetic.picture(camera, episode.seed, time)
                assert np.array_equal(decoded(frame[name]), shown)
            index += 1
    info = read_json(root / "meta/info.json")
    assert (info["fps"], info["total_frames"]) == (20, index)
    # Two tasks and settings; episode 1 of each task fails.
    assert info["total_episodes"] == len(facts) == 8


@pytest.mark.parametrize("version", COLUMNS)
def test_every_frame_has_the_words_of_its_episode(export, version):
    root = export(format=version)

    texts = texts_of(root)
    facts = pd.read_parquet(root / "meta/demonstrations.parquet").set_index("episode_index")
    for row, frames in episodes_of(root):
        told = facts.loc[row["episode_index"]]
        episode = get_episode(told.task, told.split, int(told.episode))
        assert told.text == instruct(episode, told.setting, told.form).text == row["tasks"][0]
        assert told.explicit == instruct(episode).text
        assert row["length"] == len(frames) == synthetic.STEPS
        assert {texts[frame["task_index"]] for frame in frames} == {told.text}
    assert read_json(root / "meta/info.json")["total_tasks"] == len(texts)


def test_version_3_has_pose_actions_and_subgoals(export):
    """Of a task without a video."""
    _, frames = next(episodes_of(export()))

    episode = get_episode("PickXtimes", "train", 0)
    recorded = synthetic.arrays_of(episode, synthetic.STEPS + 1, 0, has_depth=False)
    for time, frame in enumerate(frames):
        assert frame["pose_action"] == pytest.approx(recorded["pose_actions"][time + 1])
        assert frame["subgoal"] == recorded["subgoals"][time + 1]
        assert not frame["is_video_demo"]


@pytest.mark.parametrize("column", ["next.done", "next.success", "next.reward"])
def test_version_3_rewards_the_last_of_seven_steps(column, export):
    _, frames = next(episodes_of(export()))

    assert [frame[column] for frame in frames] == [0, 0, 0, 0, 0, 0, 1]


def test_version_3_names_all_columns_and_all_episodes(export):
    """All eight episodes are for training."""
    root = export()

    info = read_json(root / "meta/info.json")
    _, frames = next(episodes_of(root))
    assert info["splits"] == {"train": "0:8"}
    assert set(info["features"]) == set(frames[0])
    assert None not in [feature["names"] for feature in info["features"].values()]


def test_version_3_has_statistics_of_episodes_and_of_all_frames(export):
    root = export()

    every = []
    for row, frames in episodes_of(root):
        end = len(every) + len(frames)
        assert (row["dataset_from_index"], row["dataset_to_index"]) == (len(every), end)
        states = np.array([frame["observation.state"] for frame in frames])
        assert np.allclose(row["stats/observation.state/max"], states.max(axis=0))
        every += frames
    stats = read_json(root / "meta/stats.json")
    assert set(stats) == set(every[0]) - {"subgoal", "grounded_subgoal"}
    for name in ("observation.state", "action", "index", "next.success"):
        values = np.array([np.atleast_1d(frame[name]) for frame in every], dtype=float)
        for what in ("min", "max", "mean", "std"):
            assert np.allclose(stats[name][what], getattr(values, what)(axis=0))
        assert np.allclose(stats[name]["q99"], np.quantile(values, 0.99, axis=0))
        assert stats[name]["count"] == [len(every)]
    pixels = np.stack([decoded(frame[WRIST]) for frame in every]).reshape(-1, 3) / 255.0
    assert np.ravel(stats[WRIST]["mean"]) == pytest.approx(pixels.mean(axis=0))


def test_version_3_stores_pictures_of_two_settings_once(export):
    both = data_bytes(export())
    single = data_bytes(export("one", settings=("explicit",)))

    assert both < 1.3 * single


def data_bytes(root):
    """Return the size of an export's frames, with their pictures."""
    return sum(path.stat().st_size for path in (root / "data").rglob("*.parquet"))


@pytest.mark.parametrize(
    ("version", "pictures"), [("lerobot-v3", "png"), ("lerobot-v2.1", "lossless-video")]
)
def test_one_camera_in_small_pictures(export, version, pictures):
    root = export(
        cameras=("wrist",), size=96, pictures=pictures, format=version, settings=("explicit",)
    )
    info = read_json(root / "meta/info.json")
    stats = read_json(root / "meta/stats.json")
    shown = [name for name in info["features"] if "images" in name]

    assert shown == [name for name in stats if "images" in name] == [WRIST]
    assert info["features"][WRIST]["shape"] == [96, 96, 3]
    assert stats[WRIST]["count"] == stats["action"]["count"] == [4 * synthetic.STEPS]

    seed = get_episode("PickXtimes", "train", 0).seed
    expected = scaled_square(synthetic.picture("wrist", seed, 3), 96)
    if pictures == "png":
        path = min((root / "data").rglob("*.parquet"))
        found = decoded(read_rows(path)[3][WRIST])
    else:
        found = frames_of(min(root.rglob("*.mp4")))[3]
    assert np.array_equal(found, expected)
    assert "Cameras: wrist; 96 × 96 pixels." in (root / "README.md").read_text()


def test_the_video_comes_before_the_policy_and_is_marked(export):
    episode = get_episode("VideoUnmask", "train", 0)
    key = "videos/observation.images.wrist"

    root = export(video=True, pictures="lossless-video", tasks=("VideoUnmask",), episodes=(0,))

    assert read_json(root / "meta/stats.json")[WRIST]["count"] == [2 * (4 + synthetic.STEPS)]
    for row, frames in episodes_of(root):
        assert [frame["is_video_demo"] for frame in frames].index(False) == 4
        expected = synthetic.arrays_of(episode, len(frames) + 1, 4, has_depth=False)
        assert frames[3]["action"] == expected["actions"][4].tolist()
        assert row[f"{key}/from_timestamp"] == 0.0
        assert row[f"{key}/to_timestamp"] == pytest.approx(len(frames) / 20)
        video = frames_of(root / f"{key}/chunk-000/file-000.mp4")
        for time in range(len(frames)):
            assert np.array_equal(video[time], synthetic.picture("wrist", episode.seed, time))


def test_version_2_1_has_a_file_and_statistics_for_each_episode_and_no_videos(export):
    """Two tasks and two settings of two episodes that succeed."""
    root = export(format="lerobot-v2.1")

    assert len(list((root / "data").rglob("*.parquet"))) == 8
    assert len(read_lines(root / "meta/episodes_stats.jsonl")) == 8
    info = read_json(root / "meta/info.json")
    assert (info["total_videos"], info["total_chunks"]) == (0, 1)


def test_version_2_1_describes_its_columns_in_each_file(export):
    """LeRobot reads this version without saying what the columns are."""
    root = export(format="lerobot-v2.1")

    path = next((root / "data").rglob("*.parquet"))
    described = json.loads(parquet.read_schema(path).metadata[b"huggingface"])
    types = described["info"]["features"]
    assert types["image"] == {"_type": "Image"}
    value = {"dtype": "float32", "_type": "Value"}
    assert types["actions"] == {"feature": value, "length": 8, "_type": "Sequence"}


def test_version_2_1_says_where_the_gripper_is_in_the_state(export):
    """After the seven joints."""
    modality = read_json(export(format="lerobot-v2.1") / "meta/modality.json")

    assert modality["state"]["gripper"] == {"start": 7, "end": 8, "original_key": "state"}


READ_BACK = {
    ("PickXtimes", 0): 0,
    ("PickXtimes", 2): 0,
    ("VideoUnmask", 0): 4,
    ("VideoUnmask", 2): 4,
}
"""Task and number of the episodes that succeed, and the rows of their video."""


@pytest.mark.parametrize("version", COLUMNS)
def test_each_trajectory_is_read_back_once(export, version):
    """Also where two settings give it different words."""
    found = read_dataset(export(format=version, video=True))

    assert [(trajectory.task, trajectory.index) for trajectory in found] == list(READ_BACK)


@pytest.mark.parametrize("version", [*COLUMNS, "robomme-hdf5"])
def test_actions_and_states_are_read_back_without_the_video(export, version):
    """The first row after the video is the state at reset; its action was not taken."""
    root = export(format=version, video=True)

    for found, (task, index) in zip(read_dataset(root), READ_BACK, strict=True):
        episode = get_episode(task, "train", index)
        video = READ_BACK[task, index]
        rows = video + 1 + synthetic.STEPS
        recorded = synthetic.arrays_of(episode, rows, video, has_depth=False)
        assert (found.task, found.seed) == (task, episode.seed)
        assert np.array_equal(found.actions, recorded["actions"][video + 1 :])
        assert np.array_equal(found.states[:, :7], recorded["joint_positions"][video + 1 :])


@pytest.mark.parametrize("version", COLUMNS)
def test_the_last_state_is_read_back_with_the_gripper(export, version):
    """RoboMME's format has no last state."""
    found = next(iter(read_dataset(export(format=version))))

    episode = get_episode("PickXtimes", "train", 0)
    recorded = synthetic.arrays_of(episode, 1 + synthetic.STEPS, 0, has_depth=False)
    assert np.array_equal(found.final_state[7:], recorded["gripper"][-1])
