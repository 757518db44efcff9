"""Demonstrations: replays are exact, and the cache changes nothing."""

import dataclasses
import pickle
import weakref
from typing import Any, NamedTuple

import msgspec
import numpy as np
import pytest
from flat_jobs import job_of
from selection import slow_but

import roboirg
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

VIDEO_TASKS = [task for task in all_tasks() if get_episode(task, "test", 0).demonstration]
SHORT = "VideoUnmask"
"""A task whose video has 66 moments, after which the robot goes home for a step."""


class Reset(NamedTuple):
    """An environment that was reset, and what it gave."""

    env: Any
    observation: Any
    info: Any
    video: Any


def reset(task=SHORT, **options):
    """Make an environment of test episode 1, without cameras unless some are wanted; reset it."""
    env = roboirg.make(task, **{"episode": 1, "cameras": (), **options})
    observation, info = env.reset()
    return Reset(env, observation, info, info.pop("demonstration"))


@pytest.fixture(scope="module", autouse=True)
def _meshes_read_once():
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


@pytest.fixture
def replays(monkeypatch):
    """The sessions that have played a demonstration, in order."""
    sessions = []
    play = EpisodeSession.play_demonstration

    def counted(self, *arguments):
        sessions.append(self)
        return play(self, *arguments)

    monkeypatch.setattr(EpisodeSession, "play_demonstration", counted)
    return sessions


def check_same(first, second):
    """Assert that two mappings have the same keys in order, and equal values to the bit."""
    assert list(first) == list(second)
    for key, value in first.items():
        assert np.asarray(value).dtype == np.asarray(second[key]).dtype, key
        assert np.array_equal(value, second[key]), key


def states_of_demonstration(session, recording=None):
    """Play the demonstration of a session, as recorded if a recording is given.

    Returns a recording of it, and a hash of the state at each moment of its video.
    """
    states = []
    played = session.play_demonstration(lambda _: states.append(session.state_hash()), recording)
    return played, states


@pytest.mark.parametrize("task", slow_but((SHORT, "VideoRepick"), VIDEO_TASKS))
def test_replaying_a_recorded_demonstration_gives_bit_identical_states(task):
    """One session plans the robot's motions, the other repeats the recorded actions, which went
    through bytes, and has cameras. All hashes of the state, one for each moment of the video, the
    hash at the end, and the events must be the same."""
    episode = get_episode(task, "test", 3)
    planned = EpisodeSession(episode, visible=False)
    replayed = EpisodeSession(episode, visible=True)

    recording, states = states_of_demonstration(planned)
    restored = Recording.from_bytes(recording.to_bytes())
    again, states_again = states_of_demonstration(replayed, restored)

    assert states_again == states
    assert len(states) == restored.video_length(episode)
    assert again.end == recording.end == restored.end
    assert replayed.events == planned.events


@pytest.mark.parametrize("task", slow_but((SHORT, "VideoRepick"), VIDEO_TASKS))
def test_after_a_replay_random_actions_lead_to_the_same_state_as_after_planning(task):
    """One session has planned the motions of the video, the other has repeated the recorded
    actions. What cannot be read, such as the solver's memory of contacts, shows in what comes
    next: 100 random actions."""
    planned = EpisodeSession(get_episode(task, "test", 3), visible=False)
    replayed = EpisodeSession(get_episode(task, "test", 3), visible=False)
    recording = planned.play_demonstration()
    replayed.play_demonstration(recording=recording)

    for noise in np.random.default_rng(5).normal(0.0, 0.2, (100, 8)):
        planned.step(HOME_ACTION + noise)
        replayed.step(HOME_ACTION + noise)

    assert replayed.state_hash() == planned.state_hash()


@pytest.mark.parametrize(
    ("task", "every"), slow_but([(SHORT, 3)], [(SHORT, 3), ("VideoPlaceOrder", 60)])
)
def test_video_pictures_read_after_the_policy_acted_show_the_demonstration(task, every):
    """A hook takes a picture with both cameras at each moment of the video while it is played. The
    video that the reset returns has pictures of every third, or sixtieth, moment, which are drawn
    when they are read: here after the robot has moved and the environment was closed."""
    taken = {"front_rgb": [], "wrist_rgb": []}

    def take_pictures(env, is_demonstration):
        if is_demonstration:
            taken["front_rgb"].append(env.picture("front"))
            taken["wrist_rgb"].append(env.picture("wrist"))

    env = roboirg.make(task, episode=1, demonstration_frames=every)
    env.set_frame_hook(take_pictures)
    _, info = env.reset()
    env.step_chunk(np.tile(HOME_ACTION + 0.1, (20, 1)))
    env.close()

    video = info["demonstration"]

    assert video.length == len(taken["front_rgb"]) == len(video["gripper"])
    for key, pictures in taken.items():
        assert np.array_equal(video[key], pictures[::every]), key


def test_depth_and_calibration_of_the_video_are_those_of_its_moments():
    """A hook reads the observation of the wrist camera, with depth and matrices, at each moment of
    the video while it is played. The video that the reset returns, drawn later, must be the
    stack of these."""
    moments = []

    def read(env, is_demonstration):
        if is_demonstration:
            moments.append(env._current.observation_builder.read())

    env = roboirg.make(SHORT, episode=1, cameras=("wrist",), depth=True, calibration=True)
    env.set_frame_hook(read)
    video = env.reset()[1]["demonstration"]

    stacked = {key: np.stack([moment[key] for moment in moments]) for key in moments[0]}
    check_same(video, stacked)


def test_a_reset_draws_no_picture_of_its_video(cameras_drawn):
    """But one of each camera for the first observation."""
    video = reset(cameras=("front", "wrist")).video

    assert cameras_drawn == ["front", "wrist"]
    assert video.length == len(video["joint_positions"]) == 66
    assert "front_rgb" in video
    assert "front_rgb (not drawn)" in repr(video)
    assert cameras_drawn == ["front", "wrist"]


def test_pictures_of_a_video_can_be_read_after_its_environment_is_closed(cameras_drawn):
    """Closing frees the world of the environment. The 66 pictures of the wrist camera are then
    drawn in a new one, when they are read, and those of the front camera are not."""
    env, _, _, video = reset(cameras=("front", "wrist"))
    world = weakref.ref(env.session.world)
    env.close()
    cameras_drawn.clear()
    assert world() is None

    assert video["wrist_rgb"].shape == (66, 256, 256, 3)
    assert cameras_drawn == ["wrist"] * 66


def test_a_pickled_video_has_all_its_arrays_and_needs_no_simulator():
    """The copy has the same 66 moments to the bit, but no recorded actions from which anything
    could be drawn: all is in it."""
    video = reset(cameras=("front",)).video

    other = pickle.loads(pickle.dumps(video))  # noqa: S301 - our own

    check_same(dict(other), dict(video))
    assert other.length == 66
    assert len(other.actions) == 0


def test_reading_a_camera_draws_all_its_pictures_in_one_replay(cameras_drawn, replays):
    """66 moments, every fifth: 14 pictures. They are kept."""
    video = reset(cameras=("front", "wrist"), depth=True, demonstration_frames=5).video
    cameras_drawn.clear()
    replays.clear()

    wrist = video["wrist_rgb"]

    assert (len(replays), cameras_drawn) == (1, ["wrist"] * 14)
    assert video["wrist_rgb"] is wrist


def video_of_which_the_wrist_was_read():
    """Return a video of 14 pictures from each of two cameras, after those of the wrist were read.

    It has 66 moments, every fifth of which has pictures.
    """
    video = reset(cameras=("front", "wrist"), depth=True, demonstration_frames=5).video
    assert video["wrist_rgb"].shape == (14, 256, 256, 3)
    return video


def test_drawing_a_video_draws_what_was_not_read_and_nothing_twice(cameras_drawn, replays):
    """Reading the pictures of the wrist camera has drawn them. `draw` has only the 14 of the front
    camera to draw, for which it plays the video again, once; a second `draw` has nothing to do. The
    fixtures note the camera of each picture that is drawn, and each time the video is played."""
    video = video_of_which_the_wrist_was_read()
    cameras_drawn.clear()
    replays.clear()

    video.draw()
    video.draw()

    assert cameras_drawn == ["front"] * 14
    assert len(replays) == 1
    assert "not drawn" not in repr(video)


def test_a_video_that_was_drawn_has_the_same_arrays_as_one_that_was_read():
    """One is drawn as a whole after its wrist camera was read, the other is read array by array."""
    drawn = video_of_which_the_wrist_was_read()
    read = video_of_which_the_wrist_was_read()

    drawn.draw()

    check_same(dict(drawn), dict(read))


class Viewer:
    """Acts on the pictures of the video, of which it gets every sixth."""

    demonstration_frames = 6

    def reset(self, instruction, demonstration):
        self.seen = demonstration["wrist_rgb"].mean(axis=(1, 2, 3))

    def act(self, observation):
        actions = np.tile(HOME_ACTION, (40, 1))
        actions[:11, 0] += 1e-3 * self.seen
        return actions


def record_of_viewer(folder):
    """Return the fields of the record of a run, but for those that tell the time."""
    job = job_of(
        policy=f"{__name__}:Viewer", task=SHORT, split="test", episode=1, setting="direct",
        max_steps=80,
    )  # fmt: skip
    record = msgspec.structs.asdict(EpisodeRunner(folder)(job))
    for name in ("started_at", "duration_s", "timings", "details"):
        del record[name]
    return record


def test_a_run_records_the_same_with_an_empty_a_filled_and_no_cache(cache, tmp_path, monkeypatch):
    """The policy acts on the pictures of a video of 66 steps, which come from the simulator at
    first and from the cache afterwards. A wrong picture would change its actions and so the
    record."""
    with_empty_cache = record_of_viewer(tmp_path)
    with_filled_cache = record_of_viewer(tmp_path)
    monkeypatch.setenv("ROBOIRG_CACHE", "off")
    without_cache = record_of_viewer(tmp_path)

    assert with_empty_cache["demonstration_steps"] == 66
    assert with_filled_cache == with_empty_cache
    assert without_cache == with_empty_cache


def test_a_reset_fills_the_cache_with_a_recording_and_the_pictures_of_each_camera(cache):
    """The cache is empty before. `dict` reads all arrays of the video, so that its pictures are
    drawn: one file has its actions, and one for each of two cameras has pictures."""
    dict(reset(cameras=("front", "wrist"), demonstration_frames=6).video)

    assert len(list(cache.glob("actions/*"))) == 1
    assert len(list(cache.glob("frames/*"))) == 2


def test_with_a_filled_cache_no_picture_of_the_video_is_drawn(
    cache, cameras_drawn, forbid_planning
):
    """`cameras_drawn` notes each picture that is drawn. After a first reset has filled the cache,
    planning is forbidden: the second one draws only its first observation, and its video is the
    same to the bit."""
    options = {"cameras": ("front", "wrist"), "depth": True, "demonstration_frames": 6}
    first = dict(reset(**options).video)
    cameras_drawn.clear()
    forbid_planning()

    again = dict(reset(**options).video)

    assert cameras_drawn == ["front", "wrist"]  # the first observation
    check_same(again, first)


def test_only_a_demonstration_that_was_planned_is_recorded_in_the_cache(cache):
    """`cache` is the folder of an empty cache. The robot's motions in VideoUnmask are planned, and
    written there in less than 200 kB; those in VideoRepick come recorded with the benchmark."""
    planned = reset("VideoUnmask").info["demonstration_source"]
    (entry,) = cache.glob("actions/*")
    recorded = reset("VideoRepick").info["demonstration_source"]

    assert (planned, recorded) == ("planned", "recorded")
    assert entry.stat().st_size < 200_000
    assert list(cache.glob("actions/*")) == [entry]


@pytest.mark.parametrize("task", ["VideoUnmask", "VideoRepick"])
def test_a_reset_without_planning_equals_one_that_plans_the_demonstration(
    task, cache, forbid_planning
):
    """After the first reset, planning is made to fail: the second one repeats the actions that the
    first has left in the cache or, in VideoRepick, that come with the benchmark. All that it gives
    must be the same to the bit, and the stages of the video must count as done."""
    first = reset(task, grounded=True)
    forbid_planning()

    second = reset(task, grounded=True)

    assert second.info == first.info
    check_same(second.observation, first.observation)
    check_same(dict(second.video), dict(first.video))
    assert second.env.session.judge.index == len(second.env.episode.demonstration)


def stored_recording(cache):
    """Return the store, and the name and content of the one recording in it."""
    (entry,) = cache.glob("actions/*")
    store = open_cache("actions")
    return store, entry.name, Recording.from_bytes(store.read(entry.name))


def with_another_end(recording):
    return dataclasses.replace(recording, end="0" * 64)


def with_other_actions(recording):
    return dataclasses.replace(recording, actions=recording.actions[::-1] + 0.3)


def without_actions(recording):
    return dataclasses.replace(
        recording, stages=recording.stages[:0], actions=recording.actions[:0]
    )


@pytest.mark.parametrize("spoil", [with_another_end, with_other_actions, without_actions])
def test_a_cached_recording_that_replays_differently_is_rebuilt_with_a_warning(
    cache, caplog, spoil
):
    """The cached recording of VideoUnmask's episode 1 is spoiled: it names another final state, has
    other actions, or none. The next reset warns with its name, gives what the first one gave,
    and stores the right one again."""
    first = reset()
    store, name, right = stored_recording(cache)
    store.write(name, spoil(right).to_bytes())

    second = reset()

    assert [record.levelname for record in caplog.records] == ["WARNING"]
    assert name in caplog.text
    assert "VideoUnmask/test/1" in caplog.text
    check_same(second.observation, first.observation)
    check_same(dict(second.video), dict(first.video))
    assert Recording.from_bytes(store.read(name)).end == right.end


def test_a_frame_hook_does_not_see_the_replay_of_a_wrong_recording(cache):
    """The hook must see each of the 67 steps of the demonstration once, though the cached recording
    was wrong and the demonstration is played again."""
    reset()
    store, name, right = stored_recording(cache)
    store.write(name, with_other_actions(right).to_bytes())
    seen = []
    env = roboirg.make(SHORT, episode=1, cameras=())
    env.set_frame_hook(lambda env, shown: seen.append(env.session.world.elapsed))

    env.reset()

    assert seen == list(range(1, 68))


def test_each_episode_has_a_cache_key_of_its_own_that_stays_the_same():
    """The keys of test episode 1, of the same again, and of test episode 2."""
    first = demonstration_cache.recording_key(get_episode(SHORT, "test", 1))
    again = demonstration_cache.recording_key(get_episode(SHORT, "test", 1))
    other = demonstration_cache.recording_key(get_episode(SHORT, "test", 2))

    assert again == first
    assert other != first


@pytest.fixture
def _fingerprint_made_anew():
    """What keys contain of the platform is computed once; here it is before and after."""
    demonstration_cache._platform_fingerprint.cache_clear()
    yield
    demonstration_cache._platform_fingerprint.cache_clear()


@pytest.mark.usefixtures("_fingerprint_made_anew")
@pytest.mark.parametrize(
    ("name", "other"),
    [("_SOURCE_HASH", "of other code"), ("processor_features", lambda: "of another processor")],
)
def test_the_cache_key_of_a_demonstration_changes_with_code_and_processor(monkeypatch, name, other):
    """A recording repeats the same motions only with the same code of the simulation and the same
    kind of processor, so both are part of its key: the hash of the code, and what the processor can
    do. One of them is replaced; what keys contain of them is computed once, so it is forgotten."""
    episode = get_episode(SHORT, "test", 1)
    usual_key = demonstration_cache.recording_key(episode)

    monkeypatch.setattr(demonstration_cache, name, other)
    demonstration_cache._platform_fingerprint.cache_clear()

    assert demonstration_cache.recording_key(episode) != usual_key


def test_the_cache_key_of_a_demonstration_names_the_libraries_that_compute_motions():
    """Another version of one of them may compute other motions, so the version is part of the key;
    NumPy and the others are named with what is installed."""
    fingerprint = demonstration_cache._platform_fingerprint()

    for library in ("sapien 3", "numpy ", "scipy ", "toppra ", "python 3"):
        assert library in fingerprint


def test_the_cache_key_of_pictures_names_the_driver():
    """Another driver may draw other pixels. Here it is Mesa's llvmpipe or NVIDIA's, named with its
    library, a .so file."""
    key = frame_sequence.rendering_key(FAITHFUL)

    assert "llvmpipe" in key or "NVIDIA" in key
    assert ".so" in key


def pictures_with(meshes, every):
    """Return the pictures of the video, drawn in some way, of every such moment."""
    video = reset(cameras=("front",), meshes=meshes, demonstration_frames=every).video
    return video["front_rgb"]


def test_pictures_with_other_meshes_have_a_cache_entry_of_their_own(cache):
    """Two kinds of meshes draw different pictures of the same moments, every eleventh of the video:
    two files."""
    faithful = pictures_with("faithful", every=11)
    light = pictures_with("light", every=11)

    assert not np.array_equal(light, faithful)
    assert len(list(cache.glob("frames/*"))) == 2


def test_fewer_pictures_are_not_the_first_ones_of_a_cache_entry_that_has_more(cache):
    """Pictures of every 11th moment are in the cache. Those of every 22nd are every second one of
    these, and not the first half."""
    every_11th = pictures_with("light", every=11)

    every_22nd = pictures_with("light", every=22)

    assert np.array_equal(every_22nd, every_11th[::2])


def test_a_recording_is_written_and_read_bit_for_bit():
    """Also a number next to 9 and a negative zero."""
    steps = [RecordedStep(1, np.nextafter(np.arange(8.0), 9.0)), RecordedStep(2, np.full(8, -0.0))]
    recording = Recording.from_steps(steps, "ab12")

    again = Recording.from_bytes(recording.to_bytes())

    assert again.actions.tobytes() == recording.actions.tobytes()
    assert [step.stage for step in again.steps()] == [1, 2]
    assert again.end == "ab12"


def test_a_recording_of_no_steps_has_no_actions():
    assert Recording.from_steps([], "").actions.shape == (0, 8)
