"""LeRobot's formats: every frame of an export is what was recorded."""

import io
import json

import numpy as np
import pandas as pd
import pytest
import synthetic_trajectories as synthetic
from PIL import Image
from pyarrow import parquet
from video_frames import frames_of

from roboirg.apps.demonstrations.dataset_reading import read_dataset
from roboirg.language import instruct
from roboirg.tasks.splits.splits import get_episode
from roboirg.util.media import scaled_square

WRIST = "observation.images.wrist"
VERSIONS = ("lerobot-v3", "lerobot-v2.1")


def read_json(path):
    return json.loads(path.read_text())


def read_lines(path):
    return [json.loads(line) for line in path.read_text().splitlines()]


def read_rows(path):
    return parquet.read_table(path).to_pylist()


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


def recorded_arrays(task, video=0):
    """Return what was recorded of episode 0 of a task, after so many rows of video."""
    episode = get_episode(task, "train", 0)
    return synthetic.arrays_of(episode, video + 1 + synthetic.STEPS, video, has_depth=False)


@pytest.mark.parametrize(
    ("version", "state", "action"),
    [("lerobot-v3", "observation.state", "action"), ("lerobot-v2.1", "state", "actions")],
)
def test_a_frame_has_the_state_before_its_action(export, version, state, action):
    """`VERSIONS` has the names of the columns in a version: state, action, and two cameras'
    pictures. A row of a recording has the action that led to it, so a frame has that of the next
    row. The state is seven joints and one finger. Frames are 1/20 s apart.
    """
    recorded = recorded_arrays("PickXtimes")

    _, frames = next(episodes_of(export(format=version)))

    assert len(frames) == synthetic.STEPS
    for time, frame in enumerate(frames):
        finger, _ = recorded["gripper"][time]
        assert frame[state] == [*recorded["joint_positions"][time], finger]
        assert frame[action] == recorded["actions"][time + 1].tolist()
        assert frame["timestamp"] == pytest.approx(time / 20, abs=1e-6)


@pytest.mark.parametrize(
    ("version", "front", "wrist"),
    [
        ("lerobot-v3", "observation.images.front", "observation.images.wrist"),
        ("lerobot-v2.1", "image", "wrist_image"),
    ],
)
def test_a_frame_has_the_pictures_of_both_cameras(export, version, front, wrist):
    """Each version has its own names for the columns of the front's and the wrist's pictures.

    The synthetic picture of a camera follows from the episode's seed and the row, which is the
    frame's time step.
    """
    seed = get_episode("PickXtimes", "train", 0).seed

    _, frames = next(episodes_of(export(format=version)))

    for time, frame in enumerate(frames):
        assert np.array_equal(decoded(frame[front]), synthetic.picture("front", seed, time))
        assert np.array_equal(decoded(frame[wrist]), synthetic.picture("wrist", seed, time))


@pytest.mark.parametrize("version", VERSIONS)
def test_all_frames_are_numbered_and_counted(export, version):
    """Two tasks in two settings, of which two of three episodes succeed, are eight episodes.

    Frames are numbered from 0 in each episode, and through all of them; 20 are a second.
    """
    root = export(format=version)

    numbers = []
    for _, frames in episodes_of(root):
        assert [frame["frame_index"] for frame in frames] == list(range(synthetic.STEPS))
        numbers += [frame["index"] for frame in frames]

    assert numbers == list(range(8 * synthetic.STEPS))
    info = read_json(root / "meta/info.json")
    assert (info["fps"], info["total_episodes"], info["total_frames"]) == (20, 8, len(numbers))


@pytest.mark.parametrize("version", VERSIONS)
def test_every_frame_has_the_words_of_its_episode(export, version):
    """Our table of what was recorded has the text of each episode; LeRobot's metadata have it, too,
    and each frame has its number in the dataset's list of texts.
    """
    root = export(format=version)
    texts = texts_of(root)
    recordings = read_rows(root / "meta/demonstrations.parquet")

    for recording, (row, frames) in zip(recordings, episodes_of(root), strict=True):
        assert row["episode_index"] == recording["episode_index"]
        assert row["tasks"] == [recording["text"]]
        assert {texts[frame["task_index"]] for frame in frames} == {recording["text"]}


def test_the_words_of_a_recording_are_its_instruction(export):
    """Each row of the table has the text in its own setting, made here anew, and the same command
    with nothing left implicit. Texts that differ are the dataset's tasks."""
    root = export()

    recordings = read_rows(root / "meta/demonstrations.parquet")

    for row in recordings:
        episode = get_episode(row["task"], row["split"], row["episode"])
        assert row["text"] == instruct(episode, row["setting"], row["form"]).text
        assert row["explicit"] == instruct(episode).text
    distinct = {row["text"] for row in recordings}
    assert read_json(root / "meta/info.json")["total_tasks"] == len(distinct)


def test_version_3_has_pose_actions_and_subgoals(export):
    """Of a task without a video. Row `time + 1` of a recording has the action that led to it.

    So the frame at `time` has the action and subgoal of that row.
    """
    recorded = recorded_arrays("PickXtimes")

    _, frames = next(episodes_of(export()))

    for time, frame in enumerate(frames):
        assert frame["pose_action"] == pytest.approx(recorded["pose_actions"][time + 1])
        assert frame["subgoal"] == recorded["subgoals"][time + 1]
        assert not frame["is_video_demo"]


def test_version_3_has_subgoals_and_the_instruction_in_lerobots_language_columns(export):
    """The subgoal at a frame's time is the last one that has begun; the user spoke in the first
    frame.
    """
    root = export(language=True)

    episode, frames = next(episodes_of(root))

    (said,) = frames[0]["language_events"]
    assert [said["content"]] == episode["tasks"]
    for frame in frames:
        subgoals = frame["language_persistent"]
        begun = [row for row in subgoals if row["timestamp"] <= frame["timestamp"]]
        assert begun[-1]["content"] == frame["subgoal"]


@pytest.mark.parametrize("column", ["next.done", "next.success", "next.reward"])
def test_version_3_rewards_the_last_of_seven_steps(column, export):
    """A synthetic episode has seven steps, of which the last one succeeds."""
    _, frames = next(episodes_of(export()))

    assert [frame[column] for frame in frames] == [0, 0, 0, 0, 0, 0, 1]


def test_version_3_names_all_columns_and_all_episodes(export):
    """Two tasks, two settings and two successes are eight episodes, all of them for training."""
    root = export()

    info = read_json(root / "meta/info.json")
    _, frames = next(episodes_of(root))
    assert info["splits"] == {"train": "0:8"}
    assert set(info["features"]) == set(frames[0])
    assert None not in [feature["names"] for feature in info["features"].values()]


def all_frames(root):
    """Return the frames of all episodes, one after the other."""
    frames = []
    for _, of_episode in episodes_of(root):
        frames += of_episode
    return frames


def test_version_3_has_statistics_of_each_episode_and_where_it_lies(export):
    """Episodes lie one after the other: each begins where the one before it ends."""
    begin = 0
    for row, frames in episodes_of(export()):
        states = np.array([frame["observation.state"] for frame in frames])
        assert np.allclose(row["stats/observation.state/max"], states.max(axis=0))
        assert (row["dataset_from_index"], row["dataset_to_index"]) == (begin, begin + len(frames))
        begin += len(frames)


@pytest.mark.parametrize("name", ["observation.state", "action", "index", "next.success"])
def test_version_3_has_statistics_of_all_frames(export, name):
    """NumPy computes the same from all frames of the export, read one after the other."""
    root = export()

    stats = read_json(root / "meta/stats.json")[name]

    values = np.array([np.atleast_1d(frame[name]) for frame in all_frames(root)], dtype=float)
    assert np.allclose(stats["min"], values.min(axis=0))
    assert np.allclose(stats["max"], values.max(axis=0))
    assert np.allclose(stats["mean"], values.mean(axis=0))
    assert np.allclose(stats["std"], values.std(axis=0))
    assert np.allclose(stats["q99"], np.quantile(values, 0.99, axis=0))
    assert stats["count"] == [len(values)]


def test_version_3_has_statistics_of_pictures_between_0_and_1(export):
    """LeRobot divides pixels of 0 to 255 by 255, so the mean of a color is that of all pixels of
    all frames, divided by 255. Texts such as subgoals have no statistics.
    """
    root = export()

    stats = read_json(root / "meta/stats.json")

    pictures = np.stack([decoded(frame[WRIST]) for frame in all_frames(root)])
    mean = pictures.reshape(-1, 3).mean(axis=0) / 255
    assert np.ravel(stats[WRIST]["mean"]) == pytest.approx(mean)
    assert not {"subgoal", "grounded_subgoal"} & set(stats), "texts have none"


def test_version_3_stores_pictures_of_two_settings_once(export):
    """Two settings have other words and the same pictures, which take nearly all of the room.

    Stored twice they would take 2 times as much as of one setting; 1.3 leaves room for the rest.
    """
    both = data_bytes(export())
    single = data_bytes(export("one", settings=("explicit",)))

    assert both < 1.3 * single


def data_bytes(root):
    """Return the size of an export's frames, with their pictures."""
    return sum(path.stat().st_size for path in (root / "data").rglob("*.parquet"))


SMALL = {"cameras": ("wrist",), "size": 96, "settings": ("explicit",)}
PICTURES_IN_TABLES = {"format": "lerobot-v3", "pictures": "png", **SMALL}
PICTURES_IN_FILMS = {"format": "lerobot-v2.1", "pictures": "lossless-video", **SMALL}
"""Exports of the wrist's pictures alone, of 96 × 96 pixels, of four episodes in one setting."""


@pytest.mark.parametrize("options", [PICTURES_IN_TABLES, PICTURES_IN_FILMS])
def test_one_camera_in_small_pictures_is_described_as_such(export, options):
    """Two tasks with two successful episodes each, of seven steps: 4 * 7 pictures."""
    root = export(**options)

    info = read_json(root / "meta/info.json")
    assert [name for name in info["features"] if "images" in name] == [WRIST]
    assert info["features"][WRIST]["shape"] == [96, 96, 3]
    assert read_json(root / "meta/stats.json")[WRIST]["count"] == [4 * 7]
    assert "Cameras: wrist; 96 × 96 pixels." in (root / "README.md").read_text()


@pytest.fixture
def scaled_picture():
    """The wrist's picture at step 3 of the first synthetic episode, scaled to 96 × 96 pixels."""
    seed = get_episode("PickXtimes", "train", 0).seed
    return scaled_square(synthetic.picture("wrist", seed, 3), 96)


def test_small_pictures_in_tables_are_scaled(export, scaled_picture):
    """A row of the first table is a step of the first episode, and has its picture as PNG."""
    root = export(**PICTURES_IN_TABLES)

    rows = read_rows(min(root.rglob("data/**/*.parquet")))

    assert np.array_equal(decoded(rows[3][WRIST]), scaled_picture)


def test_small_pictures_in_films_are_scaled(export, scaled_picture):
    """The first film is that of the first episode; its coding loses nothing."""
    root = export(**PICTURES_IN_FILMS)

    pictures = frames_of(min(root.rglob("*.mp4")))

    assert np.array_equal(pictures[3], scaled_picture)


@pytest.fixture
def export_with_video(export):
    """The folder of one episode with four frames of video before the policy's turn."""
    return export(
        video=True, pictures="lossless-video", tasks=("VideoUnmask",), episodes=(0,),
        settings=("explicit",),
    )  # fmt: skip


def test_the_video_comes_before_the_policys_turn_and_is_marked(export_with_video):
    """Four frames of video, then those of the policy; frame 3 has the action that led to row 4."""
    recorded = recorded_arrays("VideoUnmask", video=4)

    _, frames = next(episodes_of(export_with_video))

    assert [frame["is_video_demo"] for frame in frames] == [True] * 4 + [False] * synthetic.STEPS
    assert frames[3]["action"] == recorded["actions"][4].tolist()


def test_a_film_of_an_episode_shows_the_video_too(export_with_video):
    """The synthetic episode has four frames of the task's video, which come before the policy's
    turn, and then seven of the policy: 11 frames, at 20 a second. One more picture, after the last
    step, is in the film and belongs to no frame.

    The synthetic picture of a frame follows from the episode's seed and the frame's number.
    """
    seed = get_episode("VideoUnmask", "train", 0).seed
    key = f"videos/{WRIST}"

    row, _ = next(episodes_of(export_with_video))
    film = frames_of(export_with_video / f"{key}/chunk-000/file-000.mp4")

    assert row[f"{key}/from_timestamp"] == 0.0
    assert row[f"{key}/to_timestamp"] == pytest.approx((4 + 7) / 20)
    expected = [synthetic.picture("wrist", seed, number) for number in range(4 + 7 + 1)]
    assert np.array_equal(film, expected)


def test_version_2_1_has_a_file_and_statistics_for_each_episode_and_no_videos(export):
    """Two tasks in two settings, with two successful episodes each, are eight episodes. A chunk is
    a folder of up to 1,000 files; pictures are in tables here, not in videos.
    """
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
    """The state is seven joints and then the gripper, so it is value 7, up to but without 8."""
    modality = read_json(export(format="lerobot-v2.1") / "meta/modality.json")

    assert modality["state"]["gripper"] == {"start": 7, "end": 8, "original_key": "state"}


@pytest.mark.parametrize("version", VERSIONS)
def test_each_trajectory_is_read_back_once(export, version):
    """Also where two settings give it different words. Episode 1 of each task fails."""
    found = read_dataset(export(format=version, video=True))

    assert [(trajectory.task, trajectory.index) for trajectory in found] == [
        ("PickXtimes", 0), ("PickXtimes", 2), ("VideoUnmask", 0), ("VideoUnmask", 2),
    ]  # fmt: skip


@pytest.mark.parametrize("version", [*VERSIONS, "robomme-hdf5"])
@pytest.mark.parametrize(("task", "video"), [("PickXtimes", 0), ("VideoUnmask", 4)])
def test_actions_and_states_are_read_back_without_the_video(export, version, task, video):
    """A recording has `video` rows of video, the state at reset, then a row for each action.

    So actions begin at row `video + 1`; the action of the row at reset was not taken.
    """
    recorded = recorded_arrays(task, video)

    found, _ = read_dataset(export(format=version, video=True, tasks=(task,)))

    assert (found.task, found.seed) == (task, get_episode(task, "train", 0).seed)
    assert np.array_equal(found.actions, recorded["actions"][video + 1 :])
    assert np.array_equal(found.states[:, :7], recorded["joint_positions"][video + 1 :])


@pytest.mark.parametrize("version", VERSIONS)
def test_the_last_state_is_read_back_with_the_gripper(export, version):
    """After seven joints a state has the two fingers. RoboMME's format has no last state."""
    found, *_ = read_dataset(export(format=version))

    assert np.array_equal(found.final_state[7:], recorded_arrays("PickXtimes")["gripper"][-1])
