"""RoboMME's episodes as data: the shipped files are what the rows give, and they replay."""

import importlib.util
import json
import math
from collections import Counter
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from page_text import call
from selection import slow_but

from roboirg.core.episode import SPLITS, Scene, SceneObject
from roboirg.core.errors import InvalidValueError, RoboIRGError
from roboirg.core.motions import Point, Swap
from roboirg.tasks import all_tasks, every_task, get_task
from roboirg.tasks.splits import published_episodes
from roboirg.tasks.splits.episode_export import write_episodes
from roboirg.tasks.splits.published_episodes import published_episode, published_text
from roboirg.tasks.splits.recordings import is_recorded, recorded_actions
from roboirg.tasks.splits.scene_codec import decode, encode
from roboirg.tasks.splits.splits import SIZES, get_episode

ROWS = Path(__file__).parent / "robomme"
SCRIPT = Path(__file__).parents[2] / "scripts" / "convert_robomme_episodes.py"


@pytest.fixture(scope="module")
def converter():
    spec = importlib.util.spec_from_file_location("convert_robomme_episodes", SCRIPT)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_the_shipped_file_is_what_the_rows_give(converter):
    """The rows are RoboMME's published data; the script converts them to the lines of the file that
    comes with the package."""
    assert list(converter.converted_lines(ROWS)) == published_text().splitlines()


def test_a_damaged_file_is_one_sentence(monkeypatch):
    """The expected checksum is replaced by zeros, so the file, whose checksum begins with 300e,
    counts as damaged."""
    monkeypatch.setattr(published_episodes, "SHA256", "0" * 64)
    with pytest.raises(RoboIRGError, match=r"published\.jsonl\.gz is damaged: its SHA-256 is 300e"):
        published_text()


def test_every_episode_is_there_but_those_that_robomme_cannot_build():
    """RoboMME's own code cannot build six of its episodes, which so are not published. Counted is,
    for each task and split, how many lack (None); `+` drops those with none missing."""
    missing = Counter()
    for task in all_tasks():
        for split in SPLITS:
            for index in range(SIZES[split]):
                missing[task, split] += published_episode(task, split, index) is None

    assert +missing == {
        ("VideoPlaceOrder", "train"): 3,
        ("VideoPlaceOrder", "val"): 2,
        ("VideoPlaceButton", "val"): 1,
    }


def test_tasks_of_the_real_robot_have_no_published_episodes():
    """RoboMME published episodes of its own tasks only; PutInBox is a task of the study with a real
    robot."""
    assert published_episode("PutInBox", "test", 0) is None


@pytest.mark.parametrize("task", every_task())
def test_scenes_survive_the_codec(task):
    """Scene and goal of four episodes are encoded, written as JSON, read and decoded. They must be
    equal to what they were, up to the seven decimals that are written; the motions, of which
    several classes have the same fields, must be of the same classes."""
    for index in range(4):
        episode = get_episode(task, "test", index)

        written = json.loads(json.dumps([encode(episode.scene), encode(episode.goal)]))
        scene, goal = decode(written)

        assert goal == episode.goal
        assert encode(scene) == encode(episode.scene)
        assert list(map(type, scene.motions)) == list(map(type, episode.scene.motions))


numbers = st.floats(-10, 10, allow_nan=False)


@settings(max_examples=30)
@given(numbers, numbers, st.none() | st.floats(0.01, 1))
def test_objects_survive_to_the_seventh_decimal(x, yaw, radius):
    """Numbers are written with seven decimals, so they may change by less than 1e-7. An object with
    any place, turn and radius (or none) is encoded, written as JSON, read and decoded; all else
    stays equal."""
    item = SceneObject("one", "cube", Point(x, 0.0, 0.02), yaw, radius=radius, inside="container_1")

    (found,) = decode(json.loads(json.dumps(encode(Scene((item,)))))).objects

    assert found.position.x == pytest.approx(x, abs=1e-7)
    assert found.yaw == pytest.approx(yaw, abs=1e-7)
    assert replace(found, position=item.position, yaw=yaw, radius=radius) == item


def test_what_is_no_part_of_a_scene_is_not_written():
    """A scene has objects, motions and facts; an array of numbers is none of these."""
    with pytest.raises(TypeError, match="no part of a scene"):
        encode(np.zeros(3))


def test_a_part_of_an_unknown_type_is_not_read():
    with pytest.raises(KeyError):
        decode({"type": "Unknown"})


def test_recordings_are_as_long_as_robomme_s(converter):
    """A row of RoboMME's data says how many steps an episode's video took ("elapsed") and how many
    pictures it has ("frames"). The first step takes the robot home, so a recording has one action
    of 8 numbers less, and one picture less is of a stage that the video shows. Each action has the
    number of its stage, the same as the one before or the next. 590 episodes of three tasks have a
    complete recording."""
    compared = 0
    for row in converter.read_rows(ROWS):
        key = key_of(row)
        if is_recorded(*key):
            recording = recorded_actions(*key)
            stages = get_task(row["task"]).demonstration(published_episode(*key).scene)
            pictures = [number for number in recording.stages if stages[number].in_video]
            assert recording.actions.shape == (row["elapsed"] - 1, 8), key
            assert len(pictures) == row["frames"] - 1, key
            assert set(np.diff(recording.stages.astype(int))) <= {0, 1}, key
            compared += 1

    assert compared == 590


@pytest.mark.parametrize("key", [("PickXtimes", "test", 0), ("VideoPlaceOrder", "test", 7)])
def test_an_episode_without_a_complete_recording_has_none(key):
    assert not is_recorded(*key)
    with pytest.raises(KeyError):
        recorded_actions(*key)


def key_of(row):
    """Return task, split and index of RoboMME's row of an episode."""
    return row["task"], row["dataset"], row["episode"]


def body_name(reference):
    """``bin_0`` for ``<bin_0>``, also in a list of one."""
    return (reference[0] if isinstance(reference, list) else reference).strip("<>")


def is_body(episode, name, row, reference):
    """Whether an object of ours is a body of RoboMME's, told by its place."""
    start = row["start"].get(body_name(reference))
    if not isinstance(start, list):
        return episode.scene[name].kind == "button"
    return math.dist(start[:2], episode.scene[name].position[:2]) < 1e-6


@pytest.mark.parametrize("in_video", [True, False], ids=["in the video", "after it"])
def test_stages_point_at_the_objects_that_robomme_s_subgoals_point_at(converter, in_video):
    """RoboMME's rows name, for each subgoal of an episode, the body ("segment") that it points at,
    if any. The objects that our stages point at must be as many (`strict`), in the same order, and
    the same, told by their places at the start (`is_body`)."""
    for row in converter.read_rows(ROWS):
        episode = get_episode(*key_of(row))
        stages = episode.demonstration if in_video else episode.stages
        ours = [stage.points_at for stage in stages if stage.points_at]
        subgoals = [stage for stage in row["stages"] if stage["demonstration"] == in_video]
        theirs = [subgoal["segment"] for subgoal in subgoals if subgoal["segment"]]

        for name, segment in zip(ours, theirs, strict=True):
            assert is_body(episode, name, row, segment), (episode.key, name, segment)


class SeenSwap(NamedTuple):
    """What RoboMME noted when two bodies changed places: their names, None for one that it did not
    see; the first step, and the step after the last."""

    first: str
    second: str | None
    begin: int
    end: int


def seen_swaps(converter):
    """Yield each swap of ours that RoboMME noted, with its row and its note. In an episode it may
    have seen fewer swaps than there are, the first ones."""
    for row in converter.read_rows(ROWS):
        schedule = row.get("facts", {}).get("swap_schedule") or []
        swaps = get_episode(*key_of(row)).scene.motions_of(Swap)
        for swap, noted in zip(swaps, schedule, strict=False):
            yield row, swap, SeenSwap(*noted)


def test_objects_change_places_with_the_partners_that_robomme_saw(converter):
    """RoboMME noted which bodies changed places with which, but not every partner: 346 in
    VideoUnmaskSwap and 281 in VideoRepick, as many as its data have. Ours must be the same, told by
    their places at the start (`is_body`)."""
    partners = Counter()
    for row, swap, seen in seen_swaps(converter):
        episode = get_episode(*key_of(row))
        assert is_body(episode, swap.first, row, seen.first)
        if seen.second is not None:
            assert is_body(episode, swap.second, row, seen.second)
            partners[row["task"]] += 1

    assert partners == {"VideoUnmaskSwap": 346, "VideoRepick": 281}


def test_objects_change_places_at_the_steps_at_which_robomme_saw_them(converter):
    """The length of a swap is the same, and so is its first step, unless ours begins with a stage
    of the video, whenever that is."""
    for row, swap, seen in seen_swaps(converter):
        assert swap.steps == seen.end - seen.begin, key_of(row)
        assert swap.stage is not None or swap.start == seen.begin, key_of(row)


def world_after_the_recording(task):
    """Return the world after the video of a task's first test episode was replayed from RoboMME's
    actions."""
    from roboirg.simulation.episode_session import EpisodeSession
    from roboirg.simulation.recording import Recording

    session = EpisodeSession(get_episode(task, "test", 0), visible=False)
    session.play_demonstration(recording=Recording(*recorded_actions(task, "test", 0), ""))
    return session.world


def places_after_the_video(scene, row):
    """Return where RoboMME saw each object that can move after the video, (x, y), by our name.

    A row has the places at the start and after the video by RoboMME's names; ours is the object
    that stands nearest to the place at the start.
    """
    found = {}
    for name, start in row["start"].items():
        if isinstance(start, list) and name != "goal_site":
            ours = min(scene.objects, key=lambda item: math.dist(item.position[:2], start[:2]))
            found[ours.name] = row["ready"][name][:2]
    return found


@pytest.mark.sim
@pytest.mark.parametrize(
    "task", slow_but(["VideoRepick"], ["VideoRepick", "VideoPlaceButton", "VideoPlaceOrder"])
)
def test_a_recording_replays_to_robomme_s_poses(task, converter):
    """RoboMME noted the poses after the video of an episode ("ready"). Its actions are replayed
    here: at the same step the joints are the same to 1e-6 rad. Objects are within 5 mm, since
    contacts of a cube that was carried and let go differ a little."""
    rows = converter.read_rows(ROWS)
    row = next(row for row in rows if key_of(row) == (task, "test", 0))

    world = world_after_the_recording(task)

    joints = world.robot.articulation.get_qpos().ravel()
    assert world.elapsed == row["elapsed"]
    assert joints == pytest.approx(row["ready"]["panda_wristcam"]["qpos"], abs=1e-6)
    for name, place in places_after_the_video(get_episode(task, "test", 0).scene, row).items():
        assert math.dist(world.bodies[name].position[:2], place) < 0.005, name


def test_exported_episodes_are_as_stored(tmp_path, snapshot):
    """Test episode 3 of three tasks, which have hidden cubes and swaps, acts of
    the video, and yaws and radii between them. The stored text was looked at once; a difference is
    a change of the format that readers of exported episodes depend on."""
    path = tmp_path / "episodes.jsonl"
    tasks = ("VideoUnmaskSwap", "VideoPlaceOrder", "StopCube")

    count = write_episodes([get_episode(task, "test", 3) for task in tasks], path)

    assert count == 3
    assert path.read_text() == snapshot


def test_the_command_exports_a_split(tmp_path):
    """The suite *real* has the two tasks PutInBox and PickByCount. With StopCube these are three
    tasks of 50 test episodes, and the file has a line for each episode."""
    path = tmp_path / "episodes.jsonl"

    said = call("export", "episodes", "--tasks", "StopCube,real", "--out", path)

    assert said == f"Wrote 150 episodes to {path}.\n"
    rows = [json.loads(line) for line in path.read_text().splitlines()]
    tasks = Counter(row["task"] for row in rows)
    assert tasks == {"StopCube": 50, "PutInBox": 50, "PickByCount": 50}


def test_episodes_are_not_exported_to_a_folder(tmp_path):
    with pytest.raises(InvalidValueError, match="is not a file in an existing folder"):
        call("export", "episodes", "--out", tmp_path)
