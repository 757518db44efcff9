"""The plugin in the real LeRobot: `make integrations` runs this with LeRobot's own environment."""

import json
import os
import subprocess
import sys
from pathlib import Path

import gymnasium
import numpy as np
import pytest

pytest.importorskip("lerobot", reason="LeRobot is not installed here; run `make integrations`")
pytest.importorskip("lerobot_env_roboirg", reason="the plugin is not installed here")

from lerobot.configs import FeatureType, PolicyFeature
from lerobot.envs.configs import EnvConfig
from lerobot.envs.utils import (
    _call_make_env,
    _load_module_from_path,
    _normalize_hub_result,
    preprocess_observation,
)
from lerobot.processor import (
    DeviceProcessorStep,
    PolicyProcessorPipeline,
    RenameObservationsProcessorStep,
)
from replay_policy.configuration_replay import ReplayConfig
from replay_policy.modeling_replay import ReplayPolicy
from replay_table import MAX_STEPS, MESHES, SETTING, TASK, record_table

import roboirg
from roboirg.evaluation.rollout import play_episode
from roboirg.integrations.result_import import ImportOptions, import_results
from roboirg.records.record import Job
from roboirg.records.store import read_records

pytestmark = pytest.mark.sim

ROOT = Path(__file__).parents[2]
EPISODES = int(os.environ.get("ROBOIRG_EQUALITY_EPISODES", "6"))
BATCHES = [(1, False), (2, True), (3, False)]  # the last batch is full: LeRobot plays all of it
if EPISODES >= 40:
    BATCHES = [(n, use_async) for n in (1, 2, 8) for use_async in (False, True)]


@pytest.fixture(scope="session")
def checkpoint(tmp_path_factory):
    """A checkpoint of the replaying policy, as LeRobot saves them."""
    folder = tmp_path_factory.mktemp("replay")
    record_table(folder / "table.npz", EPISODES)
    picture = PolicyFeature(type=FeatureType.VISUAL, shape=(3, 256, 256))
    config = ReplayConfig(
        device="cpu",
        table=str(folder / "table.npz"),
        input_features={"observation.images.front": picture},
        output_features={"action": PolicyFeature(type=FeatureType.ACTION, shape=(8,))},
    )
    ReplayPolicy(config).save_pretrained(folder)
    steps = [RenameObservationsProcessorStep(), DeviceProcessorStep(device="cpu")]
    PolicyProcessorPipeline(steps=steps, name="policy_preprocessor").save_pretrained(folder)
    PolicyProcessorPipeline(steps=[], name="policy_postprocessor").save_pretrained(folder)
    return folder


@pytest.fixture(scope="session")
def ours(checkpoint):
    """Outcomes of our own runner with the same checkpoint."""
    results = [
        play_episode(
            Job(
                policy="replay", spec=f"lerobot://{checkpoint}", task=TASK, split="test",
                episode=episode, setting=SETTING, max_steps=MAX_STEPS, meshes=MESHES,
            )
        )
        for episode in range(EPISODES)
    ]  # fmt: skip
    assert {one.outcome for one in results} == {"success", "failure"}, results
    return [one.outcome == "success" for one in results]


def evaluate(checkpoint, out, *more):
    command = [
        str(Path(sys.executable).with_name("lerobot-eval")),
        f"--policy.path={checkpoint}", "--env.discover_packages_path=replay_policy",
        "--policy.device=cpu", "--env.type=roboirg", f"--env.task={TASK}",
        f"--env.setting={SETTING}", f"--env.meshes={MESHES}", "--env.cameras=front",
        f"--env.episode_length={MAX_STEPS}", f"--output_dir={out}", *more,
    ]  # fmt: skip
    paths = [str(ROOT / "src"), str(ROOT / "tests" / "integrations")]
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(paths)}
    done = subprocess.run(command, capture_output=True, text=True, check=False, env=environment)
    assert done.returncode == 0, done.stderr[-4000:]
    return json.loads((out / "eval_info.json").read_text())


@pytest.mark.parametrize(("batch", "use_async"), BATCHES)
def test_outcomes_are_those_of_our_runner(checkpoint, ours, tmp_path, batch, use_async):
    info = evaluate(
        checkpoint,
        tmp_path / "out",
        f"--eval.n_episodes={EPISODES}",
        f"--eval.batch_size={batch}",
        f"--eval.use_async_envs={str(use_async).lower()}",
    )
    (task,) = info["per_task"]
    assert task["task_group"] == f"{TASK}-{SETTING}-test"
    assert task["metrics"]["successes"] == ours
    path = tmp_path / "out" / "eval_info.json"
    import_results("lerobot", path, tmp_path / "run", ImportOptions("replay"))
    imported = [(one.episode, one.outcome == "success") for one in read_records(tmp_path / "run")]
    assert imported == list(enumerate(ours))


def make_batch(n_envs, **options):
    config = EnvConfig.get_choice_class("roboirg")(task=TASK, setting=SETTING, **options)
    ((task,),) = [group.values() for group in config.create_envs(n_envs, False).values()]
    return task


def test_the_video_is_played_through_the_observations():
    env = make_batch(1, video="stream", meshes=MESHES)
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


def test_the_video_is_a_key_on_request():
    env = make_batch(2, video="key", video_frames=4, cameras="front", meshes=MESHES)
    observation, _ = env.reset(seed=[1000, 1001])
    batch = preprocess_observation(observation)
    assert batch["observation.demonstration"].shape == (2, 4, 256, 256, 3)
    assert batch["observation.demonstration_steps"].tolist() == [[66], [66]]
    assert batch["observation.images.front"].shape == (2, 3, 256, 256)
    assert batch["observation.state"].shape == (2, 8)
    env.close()


def test_an_ended_sub_environment_stays_as_it_is_until_a_new_rollout():
    env = make_batch(1, episode_length=1, cameras="front", meshes=MESHES)
    env.reset(seed=[1003], options={"lerobot_new_rollout": True})
    action = np.zeros((1, 8), np.float32)
    last, *_, truncated, _ = env.step(action)
    assert truncated.all()
    again, *_ = env.step(action)  # Gymnasium resets here
    assert np.array_equal(again["pixels"]["front"], last["pixels"]["front"])
    env.reset(seed=[1004], options={"lerobot_new_rollout": True})
    assert env.call("_max_episode_steps") == (1,)
    other, *_ = env.step(action)
    assert not np.array_equal(other["pixels"]["front"], last["pixels"]["front"])
    env.close()


def test_what_reaches_a_policy_tells_neither_goal_nor_setting_nor_seed():
    env = make_batch(1, cameras="front", meshes=MESHES)
    observation, info = env.reset(seed=[1002])
    assert set(observation) == {"pixels", "agent_pos"}
    assert set(info) <= {"is_success", "_is_success", "is_video_demo", "_is_video_demo"}
    words = roboirg.make(TASK, setting=SETTING, episode=2).instruction.text
    assert env.call("task_description") == env.call("task") == (words,)
    env.close()


def test_the_hub_s_file_makes_a_batch(monkeypatch):
    options = {"task": TASK, "setting": SETTING, "cameras": ["front"], "meshes": MESHES}
    monkeypatch.setenv("ROBOIRG_HUB_OPTIONS", json.dumps(options))
    module = _load_module_from_path(str(ROOT / "integrations" / "lerobot_env_roboirg" / "env.py"))
    result = _normalize_hub_result(_call_make_env(module, n_envs=2, use_async_envs=False, cfg=None))
    (env,) = [env for group in result.values() for env in group.values()]
    assert isinstance(env, gymnasium.vector.VectorEnv)
    observation, _ = env.reset(seed=[1000, 1001])
    assert observation["pixels"]["front"].shape == (2, 256, 256, 3)
    env.close()
