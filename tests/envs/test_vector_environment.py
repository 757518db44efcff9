"""The vector environment: equal to single environments, in every autoreset mode."""

import os
import re
import signal
import subprocess
import sys
from pathlib import Path

import gymnasium
import numpy as np
import pytest
from gymnasium.vector import AutoresetMode
from selection import slow_but

import roboirg
from roboirg.core.errors import InvalidActionError, InvalidValueError, UnknownNameError
from roboirg.envs.registration import environment_id
from roboirg.envs.vector.vector_environment import stack_infos
from roboirg.envs.vector.vector_workers import SubEnvironmentError
from roboirg.simulation.physics_settings import HOME_ACTION

pytestmark = pytest.mark.sim

OPTIONS = {"setting": "spatial", "cameras": ("front",), "max_steps": 5, "meshes": "light"}
CHUNKS = [np.random.default_rng(seed).normal(0, 0.05, (3, 2, 8)) + HOME_ACTION for seed in range(9)]
"""Actions of nine calls for three environments, two steps each; episodes last three calls."""


def same(ours, theirs):
    """Return whether two observations are equal bit for bit."""
    return set(ours) == set(theirs) and all(
        np.array_equal(ours[key], value) for key, value in theirs.items()
    )


def row(batch, index):
    return {key: value[index] for key, value in batch.items()}


def tell(infos, index):
    """Return the info of one sub-environment as a single one gives it, without the video."""
    keys = [key for key in infos if not key.startswith("_") and infos[f"_{key}"][index]]
    plain = {key: infos[key][index] for key in keys if key not in {"final_obs", "final_info"}}
    plain.pop("demonstration", None)
    return {key: (value or None) if key == "cause" else value for key, value in plain.items()}


def without_video(info):
    return {key: value for key, value in info.items() if key != "demonstration"}


@pytest.mark.parametrize("mode", slow_but(["SameStep"], ["NextStep", "SameStep", "Disabled"]))
def test_sub_environments_equal_single_ones(mode):
    """Three episodes of each of three, in two processes, with chunks; then one step each."""
    vector = roboirg.make_vec("PickXtimes", 3, autoreset_mode=mode, workers=2, **OPTIONS)
    assert vector.metadata["autoreset_mode"] is AutoresetMode(mode)
    singles = [roboirg.make("PickXtimes", **OPTIONS) for _ in range(3)]
    episodes = [7, 8, 9]

    def restart(index):
        return singles[index].reset(options={"episode": episodes[index]})

    batch, infos = vector.reset(seed=57)
    for index in range(3):
        observation, info = restart(index)
        assert same(row(batch, index), observation)
        assert tell(infos, index) == without_video(info)
        assert infos["demonstration"][index].length == 0
    assert batch in vector.observation_space
    over = np.zeros(3, dtype=bool)
    ended = 0
    for chunk in CHUNKS:
        if mode == "Disabled" and over.any():
            with pytest.raises(gymnasium.error.ResetNeeded, match="reset_mask"):
                vector.step_chunk(chunk)
            episodes = [one + 3 for one in episodes]
            batch, infos = vector.reset(options={"reset_mask": over})
            for index in range(3):
                assert same(row(batch, index), restart(index)[0])
        batch, rewards, terminated, truncated, infos = vector.step_chunk(chunk)
        for index, single in enumerate(singles):
            if mode == "NextStep" and over[index]:
                episodes[index] += 3
                observation, info = restart(index)
                expected = observation, 0.0, False, False, info
            else:
                expected = single.step_chunk(chunk[index])
            if mode == "SameStep" and (expected[2] or expected[3]):
                assert same(infos["final_obs"][index], expected[0])
                final = {key: value[index] for key, value in infos["final_info"].items()}
                assert final["status"] == "timeout"
                assert final["cause"] == "not done after 5 steps"
                assert infos["_final_info"][index]
                episodes[index] += 3
                observation, info = restart(index)
                expected = (observation, *expected[1:4], info)
            assert same(row(batch, index), expected[0])
            assert (rewards[index], terminated[index], truncated[index]) == expected[1:4]
            assert tell(infos, index) == without_video(expected[4])
            ended += bool(expected[3])
        over = terminated | truncated
        assert infos["is_success"].dtype == bool
        assert infos["status"].dtype.kind == infos["cause"].dtype.kind == "U"
        assert infos["steps"].dtype == np.int64
    assert ended >= 6
    vector.close()


@pytest.mark.slow
@pytest.mark.usefixtures("without_cache")
def test_pictures_can_wait_until_they_are_read():
    drawn = roboirg.make_vec("VideoUnmask", 2, **{**OPTIONS, "cameras": ("front", "wrist")})
    lazy = roboirg.make_vec(
        "VideoUnmask", 2, lazy=True, workers=1, **{**OPTIONS, "cameras": ("front", "wrist")}
    )
    expected, _ = drawn.reset()
    observation, infos = lazy.reset()
    assert set(observation) == set(expected)
    assert same(observation, expected)
    video = infos["demonstration"][1]
    single = roboirg.make("VideoUnmask", episode=1, **OPTIONS).reset()[1]["demonstration"]
    assert video.length == single.length == 66
    assert np.array_equal(video["front_rgb"], single["front_rgb"])
    assert np.array_equal(video["gripper"], single["gripper"])
    other = infos["demonstration"][0]
    stale, *_ = lazy.step(np.tile(HOME_ACTION, (2, 1)))
    expected, *_ = drawn.step(np.tile(HOME_ACTION, (2, 1)))
    assert np.array_equal(stale["front_rgb"], expected["front_rgb"])
    lazy.reset(seed=3)
    assert np.array_equal(stale["front_rgb"], expected["front_rgb"])  # it was read
    with pytest.raises(InvalidValueError, match="'wrist_rgb' of an earlier observation"):
        stale["wrist_rgb"]
    with pytest.raises(InvalidValueError, match="'wrist_rgb' of an earlier episode's video"):
        other["wrist_rgb"]
    assert video["front_rgb"].shape == (66, 256, 256, 3)
    drawn.close()
    lazy.close()


def test_chunks_may_differ_in_length_and_history_comes_along():
    vector = roboirg.make_vec(
        "PickXtimes", 2, cameras=(), observe_every=2, delivery="turns", setting="contextual"
    )
    single = roboirg.make(
        "PickXtimes", cameras=(), observe_every=2, delivery="turns", setting="contextual", episode=1
    )
    vector.reset()
    single.reset()
    rows = np.tile(HOME_ACTION, (25, 1))
    batch, *_, infos = vector.step_chunk([rows[:3], rows])
    observation, *_, info = single.step_chunk(rows)
    assert batch["instruction"][1] == observation["instruction"]
    assert len(batch["history"][0]) == 1
    assert len(batch["history"][1]) == 12
    assert same(batch["history"][1][3], observation["history"][3])
    assert infos["heard"][1] == info["heard"]
    assert infos["steps"].tolist() == [3, 25]
    assert vector.call("unheard")[1] == single.unheard
    vector.close()


def test_every_episode_of_the_split_is_played_once_without_a_seed():
    vector = roboirg.make_vec("PickXtimes", 2, cameras=(), max_steps=1, autoreset_mode="SameStep")
    seen = []
    vector.reset()
    for _ in range(3):
        seen += [one.index for one in vector.get_attr("episode")]
        vector.step(np.tile(HOME_ACTION, (2, 1)))
    assert seen == [0, 1, 2, 3, 4, 5]
    vector.reset(seed=[None, 49], options={"setting": "direct"})
    assert [one.index for one in vector.get_attr("episode")] == [8, 49]
    vector.step(np.tile(HOME_ACTION, (2, 1)))
    assert [one.index for one in vector.get_attr("episode")] == [10, 1]
    # What a reset chose holds for those that happen by themselves.
    words = [roboirg.make("PickXtimes", setting="direct", episode=i).instruction for i in (10, 1)]
    assert list(vector.get_attr("instruction")) == words
    vector.reset(options={"episode": [5, 6]})
    assert [one.index for one in vector.get_attr("episode")] == [5, 6]
    vector.close()


def test_wrong_input_is_refused_before_anything_moves():
    with pytest.raises(InvalidValueError, match="num_envs is 0; it must be an integer >= 1"):
        roboirg.make_vec("PickXtimes", 0)
    with pytest.raises(UnknownNameError, match="autoreset mode 'same'"):
        roboirg.make_vec("PickXtimes", 2, autoreset_mode="same")
    with pytest.raises(UnknownNameError, match="no setting"):
        roboirg.make_vec("PickXtimes", 2, setting="implicit")
    vector = roboirg.make_vec("PickXtimes", 2, cameras=())
    with pytest.raises(gymnasium.error.ResetNeeded):
        vector.step(np.tile(HOME_ACTION, (2, 1)))
    with pytest.raises(
        UnknownNameError, match=r"no reset option 'epsiode'.*Did you mean 'episode'"
    ):
        vector.reset(options={"epsiode": 3})
    with pytest.raises(InvalidValueError, match="episode has 3 values for 2 sub-environments"):
        vector.reset(options={"episode": [1, 2, 3]})
    with pytest.raises(InvalidValueError, match="reset_mask is"):
        vector.reset(options={"reset_mask": np.zeros(2, dtype=bool)})
    with pytest.raises(SubEnvironmentError, match="InvalidValueError: There is no episode 50"):
        vector.reset(options={"episode": 50})
    vector.reset()
    with pytest.raises(InvalidActionError):
        vector.step(np.full((2, 8), np.nan))
    with pytest.raises(InvalidActionError, match="1 actions for 2"):
        vector.step(HOME_ACTION[None])
    assert vector.step(np.tile(HOME_ACTION, (2, 1)))[4]["steps"].tolist() == [1, 1]
    vector.close()


def test_a_lost_worker_is_named():
    vector = roboirg.make_vec("PickXtimes", 2, cameras=(), workers=2)
    vector.reset()
    os.kill(vector._processes._children[1].pid, signal.SIGKILL)
    with pytest.raises(SubEnvironmentError, match=r"worker of sub-environments 1 .* signal 9"):
        vector.step(np.tile(HOME_ACTION, (2, 1)))
    vector.close()


def test_gymnasium_makes_it():
    name = f"roboirg.envs.registration:{environment_id('PickXtimes')}"
    vector = gymnasium.make_vec(name, num_envs=2, cameras=(), render_mode="rgb_array")
    assert type(vector).__name__ == "RoboIRGVectorEnv"
    vector.reset(seed=0)
    pictures = vector.render()
    assert [picture.shape for picture in pictures] == [(256, 512, 3)] * 2
    vector.close()


def test_the_example_in_the_documents_runs(tmp_path):
    page = (Path(__file__).parents[2] / "docs" / "environment.md").read_text()
    (example,) = [
        block
        for block in re.findall(r"```python\n(.*?)```", page, re.DOTALL)
        if "make_vec" in block
    ]
    script = tmp_path / "example.py"
    script.write_text(example)
    done = subprocess.run([sys.executable, script], capture_output=True, text=True, check=False)
    assert done.stdout.strip() == "[False False False False] [16 16 16 16]", done.stderr


def test_infos_have_a_fixed_shape():
    infos = stack_infos(
        [{"cause": None, "steps": 3, "events": [1, 2]}, None, {"cause": None, "events": [3, 4]}]
    )
    assert infos["cause"].tolist() == ["", "", ""]
    assert infos["steps"].tolist() == [3, 0, 0]
    assert infos["_steps"].tolist() == [True, False, False]
    assert infos["events"].tolist() == [[1, 2], None, [3, 4]]
    assert infos["_events"].tolist() == [True, False, True]
