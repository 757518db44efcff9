"""Demonstrations: replays are exact, and the cache changes nothing."""

import dataclasses
import pickle
import sys
import tempfile
import weakref
from pathlib import Path

import msgspec
import numpy as np
import pytest
from flat_jobs import job_of
from selection import slow_but

import roboirg
from roboirg.core.observations import PICTURE_SIZE
from roboirg.runs.play.rollout import EpisodeRunner
from roboirg.simulation.cameras import Cameras
from roboirg.simulation.episode_session import EpisodeSession
from roboirg.simulation.expert.primitives import MotionPrimitives
from roboirg.simulation.physics_settings import HOME_ACTION
from roboirg.simulation.recording import RecordedStep, Recording
from roboirg.simulation.rendering.render_settings import FAITHFUL
from roboirg.simulation.video import demonstration_cache, frame_sequence
from roboirg.tasks import all_tasks
from roboirg.tasks.splits.splits import get_episode
from roboirg.util.cache import open_cache

pytestmark = [pytest.mark.sim, pytest.mark.usefixtures("without_cache")]

VIDEO_TASKS = tuple(task for task in all_tasks() if get_episode(task, "test", 0).demonstration)
SHORT_VIDEO_TASK = "VideoUnmask"


@pytest.fixture(scope="module", autouse=True)
def meshes_read_once():
    """Reads the meshes once, from the cache of the session."""
    for kind in ("faithful", "light"):
        reset(cameras=("front",), meshes=kind)


@pytest.fixture
def cache(tmp_path, monkeypatch):
    monkeypatch.setenv("ROBOIRG_CACHE", str(tmp_path / "cache"))
    return tmp_path / "cache"


@pytest.fixture
def forbid_planning(monkeypatch):
    """Makes planning fail once called."""

    def forbid():
        monkeypatch.setattr(MotionPrimitives, "execute", None)

    return forbid


@pytest.fixture
def cameras_drawn(monkeypatch):
    """Cameras whose pictures have been drawn, in order."""
    names = []
    picture = Cameras.picture

    def counted(self, camera):
        names.append(camera)
        return picture(self, camera)

    monkeypatch.setattr(Cameras, "picture", counted)
    return names


def reset(task=SHORT_VIDEO_TASK, **options):
    env = roboirg.make(task, **{"episode": 1, "cameras": (), **options})
    observation, info = env.reset()
    return env, observation, info


def check_same_arrays(first, second):
    assert list(first) == list(second)
    for key, value in first.items():
        assert value.dtype == second[key].dtype
        assert np.array_equal(value, second[key]), key


@pytest.mark.parametrize("task", slow_but((SHORT_VIDEO_TASK, "VideoRepick"), VIDEO_TASKS))
def test_replaying_a_recorded_demonstration_gives_bit_identical_states(task):
    """One session plans the robot's motions, the other repeats the recorded actions."""
    planned, replayed = (
        EpisodeSession(get_episode(task, "test", 3), visible=shown) for shown in (False, True)
    )
    first = []
    second = []
    made = planned.play_demonstration(lambda _: first.append(planned.state_hash()))
    restored = Recording.from_bytes(made.to_bytes())
    again = replayed.play_demonstration(lambda _: second.append(replayed.state_hash()), restored)

    assert first == second
    assert len(first) == restored.video_length(planned.episode) > 0
    assert again.end == made.end == restored.end
    assert planned.events == replayed.events

    # What cannot be read, such as the solver's memory of contacts, shows in what comes next.
    rng = np.random.default_rng(5)
    for _ in range(100):
        action = HOME_ACTION + rng.normal(0.0, 0.2, 8)
        planned.step(action)
        replayed.step(action)
    assert planned.state_hash() == replayed.state_hash()


@pytest.mark.parametrize(
    "task", slow_but((SHORT_VIDEO_TASK,), (SHORT_VIDEO_TASK, "VideoPlaceOrder"))
)
def test_video_pictures_read_after_the_policy_acted_show_the_demonstration(task):
    """Pictures are drawn only when they are read, by replaying the demonstration."""
    seen = {"front_rgb": [], "wrist_rgb": []}
    every = 3 if task == SHORT_VIDEO_TASK else 60
    steps = []

    def look(env, is_demonstration):
        if is_demonstration:
            steps.append(None)
            if len(steps) % every == 1:
                for field, frames in seen.items():
                    frames.append(env.picture(field.removesuffix("_rgb")))

    env = roboirg.make(task, episode=1, demonstration_frames=every)
    env.set_frame_hook(look)
    _, info = env.reset()
    env.step_chunk(np.tile(HOME_ACTION + 0.1, (20, 1)))
    env.close()

    video = info["demonstration"]

    assert video.length == len(steps) == len(video["gripper"])
    for field, frames in seen.items():
        assert np.array_equal(video[field], np.stack(frames)), field
        assert video[field] is video[field]


def test_depth_and_calibration_of_the_video_are_those_of_its_moments():
    options = {"cameras": ("wrist",), "depth": True, "calibration": True}
    seen = []
    env = roboirg.make(SHORT_VIDEO_TASK, episode=1, **options)
    env.set_frame_hook(
        lambda env, shown: seen.append(env._current.observation_builder.read()) if shown else 0
    )
    video = env.reset()[1]["demonstration"]

    assert list(video) == list(seen[0])

    check_same_arrays(
        {key: np.stack([moment[key] for moment in seen]) for key in video}, dict(video)
    )


def test_pictures_of_a_video_are_drawn_only_when_they_are_read(cameras_drawn):
    """The video has 66 moments; the first observation draws one picture of each camera."""
    env, _, info = reset(cameras=("front", "wrist"))
    world = weakref.ref(env.session.world)
    assert cameras_drawn == ["front", "wrist"]  # the first observation

    video = info["demonstration"]
    assert (video.length, len(video["joint_positions"]), "front_rgb" in video) == (66, 66, True)
    assert "front_rgb (not drawn)" in repr(video)
    assert cameras_drawn == ["front", "wrist"]

    env.close()
    assert world() is None
    assert video["wrist_rgb"].shape == (66, PICTURE_SIZE, PICTURE_SIZE, 3)
    assert cameras_drawn == ["front", "wrist"] + ["wrist"] * 66

    other = pickle.loads(pickle.dumps(video))  # noqa: S301 - our own
    check_same_arrays(dict(other), dict(video))
    assert list(other) == list(video)
    assert other.length == video.length
    assert not isinstance(other, dict)
    assert len(other.actions) == 0


def test_all_pictures_of_a_camera_are_drawn_in_one_replay(cameras_drawn, monkeypatch):
    """66 moments, every fifth: 14 pictures. A second replay draws the other camera."""
    replays = []
    play = EpisodeSession.play_demonstration
    options = {"cameras": ("front", "wrist"), "depth": True, "demonstration_frames": 5}
    _, _, info = reset(**options)
    alone = dict(reset(**options)[2]["demonstration"])
    cameras_drawn.clear()
    monkeypatch.setattr(
        EpisodeSession,
        "play_demonstration",
        lambda self, *args: (replays.append(self), play(self, *args))[1],
    )
    video = info["demonstration"]
    wrist = video["wrist_rgb"]

    assert (len(replays), cameras_drawn) == (1, ["wrist"] * 14)

    video.draw()
    assert (len(replays), cameras_drawn) == (2, ["wrist"] * 14 + ["front"] * 14)
    assert "not drawn" not in repr(video)
    assert video["wrist_rgb"] is wrist

    check_same_arrays(alone, dict(video))
    pickle.dumps(video)
    video.draw()
    assert len(replays) == 2


def everything_returned(task=SHORT_VIDEO_TASK):
    """Everything that an environment and a run return."""
    options = {"cameras": ("front", "wrist"), "demonstration_frames": Viewer.demonstration_frames}
    _, observation, info = reset(task, depth=True, grounded=True, **options)
    job = job_of(
        policy=f"{__name__}:Viewer",
        task=task,
        split="test",
        episode=1,
        setting="direct",
        max_steps=80,
    )
    with tempfile.TemporaryDirectory() as folder:
        record = msgspec.structs.asdict(EpisodeRunner(Path(folder))(job))
    for name in ("started_at", "duration_s", "timings", "details"):
        del record[name]
    video = dict(info.pop("demonstration"))
    return {**observation, **video, "first": observation["front_rgb"]}, info, record


class Viewer:
    """Acts on the pictures of the video."""

    demonstration_frames = 6

    def reset(self, instruction, demonstration):
        self.seen = demonstration["wrist_rgb"].mean(axis=(1, 2, 3))

    def act(self, observation):
        actions = np.tile(HOME_ACTION, (40, 1))
        actions[:11, 0] += 1e-3 * self.seen
        return actions


def test_results_are_equal_with_an_empty_a_filled_and_no_cache(
    cache, monkeypatch, cameras_drawn, forbid_planning
):
    """With the filled cache nothing is planned and no picture of the video is drawn."""
    monkeypatch.setitem(sys.modules, __name__, sys.modules[__name__])
    cold = everything_returned()
    at_first = len(cameras_drawn)
    assert len(list(cache.glob("actions/*"))) == 1
    assert len(list(cache.glob("frames/*"))) == 4

    with monkeypatch.context() as patch:
        patch.setenv("ROBOIRG_CACHE", "off")
        off = everything_returned()
    cameras_drawn.clear()
    forbid_planning()
    warm = everything_returned()

    # The video has 11 pictures of each of two cameras.
    assert len(cameras_drawn) == at_first - 2 * 11
    for arrays, info, record in (warm, off):
        assert record == cold[2]
        assert record["demonstration_steps"] == 66
        assert info == cold[1]
        assert arrays["instruction"] == cold[0]["instruction"]
        for key in set(arrays) - {"instruction"}:
            assert np.array_equal(arrays[key], cold[0][key]), key


@pytest.mark.parametrize("task", [SHORT_VIDEO_TASK, "VideoRepick"])
def test_a_reset_from_the_cache_equals_one_that_plans_the_demonstration(
    task, cache, forbid_planning
):
    """After the first reset, planning is forbidden: the second one has to read the cache."""
    _, observation, info = reset(task)
    small = [entry.stat().st_size < 200_000 for entry in cache.glob("actions/*")]
    # A shipped recording needs no cache.
    assert small == ([] if info["demonstration_source"] == "recorded" else [True])

    forbid_planning()
    env, again, warm = reset(task)
    check_same_arrays(dict(info.pop("demonstration")), dict(warm.pop("demonstration")))
    assert (info, observation.pop("instruction")) == (warm, again.pop("instruction"))

    check_same_arrays(observation, again)
    assert env.session.judge.index == len(env.episode.demonstration)


def stored_recording(cache):
    """Return the store, and the name and content of the one recording in it."""
    (entry,) = cache.glob("actions/*")
    store = open_cache("actions")
    return store, entry.name, Recording.from_bytes(store.read(entry.name))


@pytest.mark.parametrize("fault", ["end", "actions", "stages"])
def test_a_cached_recording_that_replays_differently_is_rebuilt_with_a_warning(
    cache, caplog, fault
):
    """The cached recording gets another final state, other actions, or no actions at all."""
    _, observation, info = reset()
    store, name, right = stored_recording(cache)
    wrong = {
        "end": {"end": "0" * 64},
        "actions": {"actions": right.actions[::-1] + 0.3},
        "stages": {"stages": right.stages[:0], "actions": right.actions[:0]},
    }
    store.write(name, dataclasses.replace(right, **wrong[fault]).to_bytes())

    _, after, rebuilt = reset()

    assert [record.levelname for record in caplog.records] == ["WARNING"]
    assert name in caplog.text
    assert f"{SHORT_VIDEO_TASK}/test/1" in caplog.text
    assert np.array_equal(after["end_effector"], observation["end_effector"])
    check_same_arrays(dict(info["demonstration"]), dict(rebuilt["demonstration"]))
    assert Recording.from_bytes(store.read(name)).end == right.end

    reset()
    assert len(caplog.records) == 1


def test_a_frame_hook_does_not_see_the_replay_of_a_wrong_recording(cache):
    """The video has 67 steps; the hook must see each of them once, though
    the cached recording was wrong and the demonstration is played again."""
    _, _, _ = reset()
    store, name, right = stored_recording(cache)
    store.write(name, dataclasses.replace(right, actions=right.actions + 0.2).to_bytes())
    seen = []
    env = roboirg.make(SHORT_VIDEO_TASK, episode=1, cameras=())
    env.set_frame_hook(lambda env, shown: seen.append(env.session.world.elapsed))

    env.reset()

    assert seen == list(range(1, 68))


def test_the_cache_key_of_a_demonstration_changes_with_code_and_processor(monkeypatch):
    """The key also names the versions of the libraries that compute motions."""
    episode = get_episode(SHORT_VIDEO_TASK, "test", 1)
    key = demonstration_cache.recording_key(episode)
    assert demonstration_cache.recording_key(get_episode(SHORT_VIDEO_TASK, "test", 1)) == key
    assert demonstration_cache.recording_key(get_episode(SHORT_VIDEO_TASK, "test", 2)) != key

    for name, other in (("_SOURCE_HASH", "another"), ("processor_features", lambda: "another")):
        with monkeypatch.context() as patch:
            patch.setattr(demonstration_cache, name, other)
            demonstration_cache._platform_fingerprint.cache_clear()
            assert demonstration_cache.recording_key(episode) != key
        demonstration_cache._platform_fingerprint.cache_clear()
    assert demonstration_cache.recording_key(episode) == key

    fingerprint = demonstration_cache._platform_fingerprint()
    for part in ("sapien 3", "numpy ", "scipy ", "toppra ", "python 3"):
        assert part in fingerprint


def test_pictures_of_other_meshes_or_frame_rates_have_their_own_cache_entries(cache):
    """*Faithful* and *light* are ways of drawing; every eleventh
    frame is another series than every twenty-second."""

    def read(meshes_read_once, every=11):
        options = {"cameras": ("front",), "meshes": meshes_read_once, "demonstration_frames": every}
        return reset(**options)[2]["demonstration"]["front_rgb"]

    faithful = read("faithful")
    assert len(list(cache.glob("frames/*"))) == 1

    key = frame_sequence.rendering_key(FAITHFUL)
    assert "llvmpipe" in key or "NVIDIA" in key
    assert ".so" in key

    light = read("light")
    assert len(list(cache.glob("frames/*"))) == 2
    assert not np.array_equal(light, faithful)
    # Fewer pictures are others, too: not the first ones of the entry that has more.
    assert all(np.array_equal(read("faithful", 11 * n), faithful[::n]) for n in (1, 2))


def test_a_recording_is_written_and_read_bit_for_bit():
    """Also a number next to 9 and a negative zero."""
    steps = [RecordedStep(1, np.nextafter(np.arange(8.0), 9.0)), RecordedStep(2, np.full(8, -0.0))]
    recording = Recording.from_steps(steps, "ab12")

    again = Recording.from_bytes(recording.to_bytes())

    assert again.actions.tobytes() == recording.actions.tobytes()
    assert [step.stage for step in again.steps()] == [1, 2]
    assert again.end == "ab12"
    assert Recording.from_steps([], "").actions.shape == (0, 8)
