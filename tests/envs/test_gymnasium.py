"""At home in Gymnasium: reset options, its own vector environments, its wrappers, its registry."""

import os
import subprocess
import sys
import warnings

import gymnasium
import numpy as np
import pytest
from gymnasium import wrappers
from selection import slow_but

import roboirg
from roboirg.core.errors import InvalidValueError, UnknownNameError
from roboirg.envs.registration import environment_id
from roboirg.simulation.physics_settings import HOME_ACTION
from roboirg.tasks.splits.splits import get_episode

pytestmark = pytest.mark.sim

OPTIONS = {"cameras": ("front",), "meshes": "light", "max_steps": 2}
NAME = f"roboirg.envs.registration:{environment_id('PickXtimes')}"


def test_a_reset_chooses_episode_and_words():
    env = roboirg.make("PickXtimes", cameras=(), episode=3)
    plain, _ = env.reset()
    chosen, _ = env.reset(options={"episode": 5, "setting": "spatial", "split": "val"})
    made = roboirg.make("PickXtimes", cameras=(), episode=5, setting="spatial", split="val")
    assert chosen["instruction"] == made.instruction.text == env.instruction.text
    assert env.episode == made.episode
    again, _ = env.reset(seed=8)  # options hold for one reset; the seed chooses nothing here
    assert again["instruction"] == plain["instruction"]
    assert env.episode.index == 3
    with pytest.raises(UnknownNameError, match="no reset option 'cameras'; known: split, episode"):
        env.reset(options={"cameras": ()})
    with pytest.raises(InvalidValueError, match="no episode 50"):
        env.reset(options={"episode": 50})
    own = roboirg.make(get_episode("PickXtimes", "test", 3), cameras=())
    own.reset(options={"setting": "spatial"})
    with pytest.raises(InvalidValueError, match="made for one episode; reset takes no 'episode'"):
        own.reset(options={"episode": 5})


def test_seeds_choose_episodes_if_none_is_named():
    env = roboirg.make("PickXtimes", cameras=(), episode=None)
    played = []
    for seed in (None, None, 1049, None, 7, 50):
        env.reset(seed=seed)
        played.append(env.episode.index)
    assert played == [0, 1, 49, 0, 7, 0]


@pytest.mark.parametrize("kind", slow_but(["sync"], ["sync", "async"]))
def test_gymnasium_s_vector_environments_work_with_their_defaults(kind):
    # In a process of its own: forking is refused where pictures have been drawn.
    code = f"""
import gymnasium, numpy as np, roboirg
from roboirg.simulation.physics_settings import HOME_ACTION
vector = gymnasium.make_vec({NAME!r}, 2, {kind!r}, episode=None, **{OPTIONS})
batch, infos = vector.reset(seed=4)
single = roboirg.make("PickXtimes", episode=5, **{OPTIONS})
observation, _ = single.reset()
for key, value in observation.items():
    assert np.array_equal(batch[key][1], value), key
assert len(batch["instruction"]) == 2 and all(batch["instruction"])
assert infos["is_success"].tolist() == [False, False]
for _ in range(2):
    batch, *_, infos = vector.step(np.tile(HOME_ACTION, (2, 1)))
    observation, *_ = single.step(HOME_ACTION)
    for key, value in observation.items():
        assert np.array_equal(batch[key][1], value), key
assert infos["cause"].tolist() == ["not done after 2 steps"] * 2
batch, *_ = vector.step(np.tile(HOME_ACTION, (2, 1)))
assert batch["instruction"][0] == roboirg.make("PickXtimes", episode=5).instruction.text
vector.close()
print("equal")
"""
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=False, env=os.environ
    )
    assert done.stdout.strip() == "equal", done.stderr


@pytest.mark.parametrize("kind", ["sync", "async"])
def test_gymnasium_s_vector_environments_hold_videos_of_different_lengths(kind):
    name = NAME.replace("PickXtimes", "VideoUnmaskSwap")
    context = {"vector_kwargs": {"context": "spawn"}} if kind == "async" else {}
    vector = gymnasium.make_vec(name, 2, kind, episode=None, cameras=(), **context)
    _, infos = vector.reset(seed=0)
    single = roboirg.make("VideoUnmaskSwap", episode=1, cameras=())
    _, info = single.reset()
    videos = infos["demonstration"]
    assert [one.length for one in videos] == [114, 168]
    for field in info["demonstration"]:
        assert np.array_equal(videos[1][field], info["demonstration"][field])
    vector.close()


def test_a_fork_after_drawing_fails_at_once_with_the_reason():
    roboirg.make("PickXtimes", **OPTIONS).reset()
    vector = gymnasium.make_vec(NAME, 2, "async", **OPTIONS)
    warnings.simplefilter("ignore")  # Gymnasium repeats the worker's traceback
    with pytest.raises(
        Exception, match=r"forked from one that had drawn pictures.*context='spawn'"
    ):
        vector.reset()
    vector.close(terminate=True)


def test_videos_can_be_recorded(tmp_path):
    pytest.importorskip("moviepy", reason="Gymnasium's RecordVideo needs moviepy")
    folder = tmp_path / "videos"
    env = gymnasium.make(NAME, render_mode="rgb_array", **OPTIONS)
    env = wrappers.RecordVideo(env, str(folder), episode_trigger=lambda _: True)
    env.reset(options={"episode": 2})
    env.step(HOME_ACTION)
    env.step(HOME_ACTION)
    env.close()
    (video,) = folder.glob("*.mp4")
    assert video.stat().st_size > 0


def test_statistics_can_be_recorded():
    env = wrappers.RecordEpisodeStatistics(gymnasium.make(NAME, **OPTIONS))
    env.reset(options={"episode": 2})
    env.step(HOME_ACTION)
    *_, truncated, info = env.step(HOME_ACTION)
    assert truncated
    assert info["episode"]["l"] == 2
    assert info["episode"]["r"] == 0.0


def test_proprioception_can_be_flattened():
    env = gymnasium.make(NAME, **OPTIONS)
    env = wrappers.FilterObservation(env, ["joint_positions", "gripper", "end_effector"])
    env = wrappers.FlattenObservation(env)
    observation, _ = env.reset()
    assert observation.shape == (15,)
    assert observation in env.observation_space
