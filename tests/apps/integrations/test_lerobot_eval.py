"""The plugin in the real LeRobot: `make integrations` runs this with LeRobot's own environment."""

import json

import numpy as np
import pytest

pytest.importorskip("lerobot", reason="LeRobot is not installed here; run `make integrations`")
pytest.importorskip("lerobot_env_roboirg", reason="the plugin is not installed here")

from lerobot.envs.configs import EnvConfig
from lerobot.envs.utils import preprocess_observation
from page_commands import check_versions, run_page
from replay_table import (
    MANY,
    MAX_STEPS,
    MESHES,
    PER_TASK,
    PLAYED,
    SETTING,
    TASKS,
    own_outcomes,
)

import roboirg

pytestmark = pytest.mark.sim

TASK = TASKS[0]
BATCHES = [(2, True), (4, False)]
if MANY:
    BATCHES = [(1, False), (2, False), (2, True), (8, False), (8, True)]


@pytest.fixture(scope="session")
def ours(checkpoint):
    """Outcomes of our own runner with the same checkpoint."""
    return [one[:3] for one in own_outcomes(f"lerobot://{checkpoint}")]


@pytest.mark.parametrize(("batch", "use_async"), BATCHES)
def test_the_page_s_commands_have_the_outcomes_of_our_runner(
    checkpoint, ours, tmp_path, batch, use_async
):
    run_page(
        "LeRobot",
        tmp_path,
        {
            "lerobot/some-checkpoint": checkpoint,
            "PickXtimes,VideoUnmask": ",".join(PLAYED),
            "contextual": f"{SETTING} --env.discover_packages_path=replay_policy "
            f"--policy.device=cpu --env.meshes={MESHES} --env.cameras=front "
            f"--env.episode_length={MAX_STEPS} --eval.use_async_envs={str(use_async).lower()}",
            "n_episodes=50": f"n_episodes={PER_TASK}",
            "batch_size=8": f"batch_size={batch}",
        },
    )
    told = json.loads((tmp_path / "runs" / "lerobot" / "eval_info.json").read_text())
    found = [
        (one["task_group"], episode, success)
        for one in told["per_task"]
        for episode, success in enumerate(one["metrics"]["successes"])  # of the seeds from 1000 on
    ]
    expected = [(f"{task}-{SETTING}-test", *verdict) for task, *verdict in ours]
    assert sorted(found) == sorted(expected)


def test_the_page_names_the_version_that_is_played():
    check_versions("LeRobot")


def make_batch(n_envs, **options):
    config = EnvConfig.get_choice_class("roboirg")(task=TASK, setting=SETTING, **options)
    ((task,),) = [group.values() for group in config.create_envs(n_envs, False).values()]
    return task


def test_the_video_is_played_through_the_observations():
    env = make_batch(1, video=True, meshes=MESHES)
    observation, info = env.reset(seed=[1001])
    video = roboirg.make(TASK, setting=SETTING, episode=1, meshes=MESHES)
    seen, shown = video.reset()
    pictures = shown["demonstration"]["front_rgb"]
    action = np.append(seen["joint_positions"], 1.0).astype(np.float32)[None]
    for picture in pictures:
        assert info["is_video_demo"].tolist() == [True]
        assert np.array_equal(observation["pixels"]["front"][0], picture)
        observation, _, terminated, truncated, info = env.step(action)
        assert not (terminated | truncated).any()
    assert info["is_video_demo"].tolist() == [False]
    assert np.array_equal(observation["pixels"]["front"][0], seen["front_rgb"])
    assert env.call("task_description") == (seen["instruction"],)
    env.close()


def test_lerobot_preprocesses_a_batch():
    env = make_batch(2, cameras="front", meshes=MESHES)
    observation, _ = env.reset(seed=[1000, 1001])
    batch = preprocess_observation(observation)
    assert batch["observation.images.front"].shape == (2, 3, 256, 256)
    assert batch["observation.state"].shape == (2, 8)
    env.close()


def test_what_reaches_a_policy_tells_neither_goal_nor_setting_nor_seed():
    env = make_batch(1, cameras="front", meshes=MESHES)
    observation, info = env.reset(seed=[1002])
    assert set(observation) == {"pixels", "agent_pos"}
    assert set(info) <= {"is_success", "_is_success", "is_video_demo", "_is_video_demo"}
    words = roboirg.make(TASK, setting=SETTING, episode=2).instruction.text
    assert env.call("task_description") == env.call("task") == (words,)
    env.close()
