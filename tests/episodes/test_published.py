"""RoboMME's episodes as data: the shipped files are what the rows give, and they replay."""

import contextlib
import importlib.util
import io
import json
import math
from collections import Counter
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import typer
from hypothesis import given, settings
from hypothesis import strategies as st
from selection import slow_but

from roboirg.core.episode import SPLITS, Scene, SceneObject
from roboirg.core.errors import InvalidValueError, RoboIRGError
from roboirg.core.motions import Point, Swap
from roboirg.main import app
from roboirg.tasks import all_tasks, every_task, get_task
from roboirg.tasks.splits import published_episodes
from roboirg.tasks.splits.episode_export import write_episodes
from roboirg.tasks.splits.published_episodes import published_episode, published_text
from roboirg.tasks.splits.recordings import is_recorded, recorded_actions
from roboirg.tasks.splits.scene_codec import decode, encode
from roboirg.tasks.splits.splits import SIZES, get_episode

ROWS = Path(__file__).parent / "robomme"
SCRIPT = Path(__file__).parents[2] / "scripts" / "convert_robomme_episodes.py"
RECORDED = ("VideoRepick", "VideoPlaceButton", "VideoPlaceOrder")
NOT_BUILT = {
    ("VideoPlaceOrder", "train"): 3,
    ("VideoPlaceOrder", "val"): 2,
    ("VideoPlaceButton", "val"): 1,
}


@pytest.fixture(scope="module")
def converter():
    spec = importlib.util.spec_from_file_location("convert_robomme_episodes", SCRIPT)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def roboirg(*words):
    """Call a command in this process and return what it prints."""
    out = io.StringIO()
    with contextlib.redirect_stdout(out):
        typer.main.get_command(app)(list(map(str, words)), standalone_mode=False)
    return out.getvalue()


def test_the_shipped_file_is_what_the_rows_give(converter):
    assert list(converter.converted_lines(ROWS)) == published_text().splitlines()


def test_a_damaged_file_is_one_sentence(monkeypatch):
    monkeypatch.setattr(published_episodes, "SHA256", "0" * 64)
    with pytest.raises(RoboIRGError, match=r"published\.jsonl\.gz is damaged: its SHA-256 is 300e"):
        published_text()


def test_every_episode_is_there_but_those_that_robomme_cannot_build():
    missing = Counter(
        (task, split)
        for task in all_tasks()
        for split in SPLITS
        for index in range(SIZES[split])
        if published_episode(task, split, index) is None
    )
    assert missing == NOT_BUILT
    assert published_episode("PutInBox", "test", 0) is None


@pytest.mark.parametrize("task", every_task())
def test_scenes_survive_the_codec(task):
    for index in range(4):
        episode = get_episode(task, "test", index)
        written = json.loads(json.dumps([encode(episode.scene), encode(episode.goal)]))
        scene, goal = decode(written)
        assert goal == episode.goal
        assert encode(scene) == encode(episode.scene)
        assert [type(motion) for motion in scene.motions] == [
            type(motion) for motion in episode.scene.motions
        ]


finite = st.floats(-10, 10, allow_nan=False)


@settings(max_examples=30)
@given(finite, finite, st.none() | st.floats(0.01, 1), st.none() | st.just("container_1"))
def test_objects_survive_to_the_seventh_decimal(x, yaw, radius, inside):
    item = SceneObject("one", "cube", Point(x, 0.0, 0.02), yaw, radius=radius, inside=inside)
    (found,) = decode(json.loads(json.dumps(encode(Scene((item,)))))).objects

    assert found.position.x == pytest.approx(x, abs=1e-7)
    assert found.yaw == pytest.approx(yaw, abs=1e-7)
    assert replace(found, position=item.position, yaw=yaw, radius=radius) == item


def test_what_is_no_part_of_a_scene_is_refused():
    with pytest.raises(TypeError, match="no part of a scene"):
        encode(np.zeros(3))
    with pytest.raises(KeyError):
        decode({"type": "Unknown"})


def test_recordings_are_as_long_as_robomme_s(converter):
    compared = 0
    for row in converter.read_rows(ROWS):
        key = (row["task"], row["dataset"], row["episode"])
        if "error" in row or row["task"] not in RECORDED or key in converter.INCOMPLETE:
            assert not is_recorded(*key)
            with pytest.raises(KeyError):
                recorded_actions(*key)
            continue
        found = recorded_actions(*key)
        stages = get_task(row["task"]).demonstration(published_episode(*key).scene)
        in_video = [stages[number].in_video for number in found.stages]
        assert found.actions.shape == (row["elapsed"] - 1, 8)
        assert sum(in_video) + 1 == row["frames"]
        assert set(np.diff(found.stages.astype(int))) <= {0, 1}
        compared += 1

    assert compared == 590


def body_name(reference):
    """``bin_0`` for ``<bin_0>``, also in a list of one."""
    return (reference[0] if isinstance(reference, list) else reference).strip("<>")


def is_body(episode, name, row, reference):
    """Whether an object of ours is a body of RoboMME's, told by its place."""
    start = row["start"].get(body_name(reference))
    if not isinstance(start, list):
        return episode.scene[name].kind == "button"
    return math.dist(start[:2], episode.scene[name].position[:2]) < 1e-6


def test_stages_point_at_the_objects_that_robomme_s_subgoals_point_at(converter):
    compared = Counter()
    for row in converter.read_rows(ROWS):
        if "error" in row:
            continue
        episode = get_episode(row["task"], row["dataset"], row["episode"])
        for shown, stages in ((True, episode.demonstration), (False, episode.stages)):
            theirs = [
                stage["segment"] for stage in row["stages"] if stage["demonstration"] == shown
            ]
            ours = [stage.points_at for stage in stages if stage.points_at]
            for name, reference in zip(ours, filter(None, theirs), strict=True):
                assert is_body(episode, name, row, reference), (episode.key, name, reference)
                compared[row["task"]] += 1
    assert compared.keys() == all_tasks().keys()


def test_objects_change_places_with_the_partners_that_robomme_saw(converter):
    compared = Counter()
    for row in converter.read_rows(ROWS):
        schedule = row.get("facts", {}).get("swap_schedule") or []
        episode = get_episode(row["task"], row["dataset"], row["episode"])
        swaps = [motion for motion in episode.scene.motions if isinstance(motion, Swap)]
        for swap, (first, second, begin, end) in zip(swaps, schedule, strict=False):
            assert is_body(episode, swap.first, row, first)
            assert second is None or is_body(episode, swap.second, row, second)
            assert swap.steps == end - begin
            if swap.stage is None:
                assert swap.start == begin
            compared[row["task"]] += second is not None
    assert compared == {"ButtonUnmaskSwap": 0, "VideoUnmaskSwap": 346, "VideoRepick": 281}


@pytest.mark.sim
@pytest.mark.parametrize("task", slow_but(["VideoRepick"], RECORDED))
def test_a_recording_replays_to_robomme_s_poses(task, converter):
    from roboirg.simulation.episode_session import EpisodeSession
    from roboirg.simulation.recording import Recording

    row = next(
        row for row in converter.read_rows(ROWS) if (row["task"], row["dataset"]) == (task, "test")
    )
    episode = get_episode(task, "test", 0)
    session = EpisodeSession(episode, visible=False)
    session.play_demonstration(recording=Recording(*recorded_actions(task, "test", 0), ""))
    joints = session.world.robot.articulation.get_qpos().ravel()
    assert np.abs(joints - row["ready"]["panda_wristcam"]["qpos"]).max() < 1e-6
    assert session.world.elapsed == row["elapsed"]
    for name, start in row["start"].items():
        if isinstance(start, dict) or name == "goal_site":
            continue
        item = min(episode.scene.objects, key=lambda item: math.dist(item.position[:2], start[:2]))
        place = session.world.bodies[item.name].position
        # Resting cubes may differ by contacts; the one that was carried is within millimeters.
        assert math.dist(place[:2], row["ready"][name][:2]) < 0.005


def test_exported_episodes_are_as_stored(tmp_path, snapshot):
    """With hidden cubes and swaps, with acts of the video, and with yaws and radii."""
    path = tmp_path / "episodes.jsonl"
    tasks = ("VideoUnmaskSwap", "VideoPlaceOrder", "StopCube")

    assert write_episodes([get_episode(task, "test", 3) for task in tasks], path) == 3
    assert path.read_text() == snapshot


def test_the_command_exports_a_split(tmp_path):
    path = tmp_path / "episodes.jsonl"
    said = roboirg("export", "episodes", "--tasks", "StopCube,real", "--out", path)
    assert said == f"Wrote 150 episodes to {path}.\n"

    rows = [json.loads(line) for line in path.read_text().splitlines()]
    assert Counter(row["task"] for row in rows) == {
        "StopCube": 50, "PutInBox": 50, "PickByCount": 50,
    }  # fmt: skip
    with pytest.raises(InvalidValueError, match="is not a file in an existing folder"):
        roboirg("export", "episodes", "--out", tmp_path)
