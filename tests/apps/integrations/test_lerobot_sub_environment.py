"""LeRobot's environment without LeRobot: the video, the end, and actions that are none."""

import numpy as np
import pytest

import roboirg
from roboirg.apps.integrations.lerobot.sub_environment import NEW_ROLLOUT, LeRobotSubEnvironment
from roboirg.apps.integrations.lerobot.vector import make_batch
from roboirg.language import instruct
from roboirg.simulation.physics_settings import HOME_ACTION
from roboirg.tasks.splits.splits import get_episode
from roboirg.util.media import scaled_square

pytestmark = pytest.mark.sim


def reset_to_episode_1(**options):
    """Return an environment of two steps of VideoUnmask, and what its reset gives.

    Its pictures have 32 × 32 pixels. Seed 51 is episode 1, as there are 50 test episodes.
    """
    env = LeRobotSubEnvironment("VideoUnmask", cameras=("front",), size=32, max_steps=2, **options)
    return env, *env.reset(seed=51)


def watch_video(env, observation):
    """Step through the video that begins with an observation; actions have no effect until its end.

    Returns:
        its pictures, and the first observation after it.
    """
    pictures = []
    info = {"is_video_demo": True}
    while info["is_video_demo"]:
        pictures.append(observation["pixels"]["front"])
        observation, *_, info = env.step(HOME_ACTION)
    return pictures, observation


def test_with_video_the_pictures_of_the_demonstration_come_first():
    """They are those that `roboirg.make` gives for the same episode, scaled to 32 pixels.

    LeRobot reads pictures from `pixels` and the state from `agent_pos`.
    """
    env, first, _ = reset_to_episode_1(video=True)

    pictures, _ = watch_video(env, first)

    _, info = roboirg.make("VideoUnmask", episode=1, cameras=("front",)).reset()
    expected = [scaled_square(picture, 32) for picture in info["demonstration"]["front_rgb"]]
    assert np.array_equal(pictures, expected)
    assert set(first) == {"pixels", "agent_pos"}


def test_after_the_video_the_policy_sees_what_it_sees_at_once_without_a_video():
    """During the video, actions have no effect, so the scene is as it is without one."""
    env, first, _ = reset_to_episode_1(video=True)
    _, seen, info = reset_to_episode_1(video=False)

    _, after_video = watch_video(env, first)

    assert np.array_equal(after_video["pixels"]["front"], seen["pixels"]["front"])
    assert not info["is_video_demo"]


def test_the_limit_of_two_steps_counts_from_the_end_of_the_video():
    """An environment of `reset_to_episode_1` has two steps: the second after the video truncates
    the episode, and later steps repeat that end."""
    env, first, _ = reset_to_episode_1(video=True)
    watch_video(env, first)

    is_truncated = []
    for _ in range(3):
        _, _, terminated, truncated, _ = env.step(HOME_ACTION)
        assert not terminated
        is_truncated.append(truncated)

    assert is_truncated == [False, True, True]


def test_a_reset_without_options_gives_the_end_of_an_ended_episode_again():
    """Gymnasium resets an environment by itself when its episode ends; LeRobot still reads the end
    until it begins a new rollout."""
    env, *_ = reset_to_episode_1()
    env.step(HOME_ACTION)
    end, *_, info = env.step(HOME_ACTION)

    assert env.reset() == (end, info)


def test_an_action_of_nan_ends_the_episode_without_success():
    """The action has eight numbers, as it should, but they are not finite. The episode is
    terminated (not truncated) without a reward.
    """
    env, *_ = reset_to_episode_1()

    _, reward, terminated, truncated, info = env.step(np.full(8, np.nan))

    assert (reward, terminated, truncated) == (0.0, True, False)
    assert info == {"is_success": False, "is_video_demo": False}


def test_an_ended_episode_repeats_its_last_transition_until_a_new_rollout():
    """An action of NaN ends the episode; the next action gives the very same transition, and the
    instruction stays that of test episode 1.

    `NEW_ROLLOUT` is the option with which a reset starts the next episode, whose steps are new.
    """
    env, *_ = reset_to_episode_1()
    ended = env.step(np.full(8, np.nan))

    assert env.step(np.zeros(8)) is ended
    assert env.task == instruct(get_episode("VideoUnmask", "test", 1)).text

    env.reset(options={NEW_ROLLOUT: True})
    assert env.step(HOME_ACTION) is not ended


def test_batches_report_the_end_where_lerobot_looks_for_it():
    """Two episodes of one step end together, as failures, since the arm only holds still.

    LeRobot 0.4 reads successes from `final_info` alone. Seeds 1000 and 1001 are episodes 0 and 1.
    """
    env = make_batch("StopCube", 2, False, {"cameras": ("front",), "size": 32, "max_steps": 1})
    env.reset(seed=[1000, 1001])
    actions = np.tile(HOME_ACTION, (2, 1)).astype(np.float32)
    *_, truncated, infos = env.step(actions)

    assert truncated.all()
    assert infos["final_info"]["is_success"].tolist() == [False, False]

    texts = [instruct(get_episode("StopCube", "test", index)).text for index in (0, 1)]
    assert list(env.call("task_description")) == texts

    env.close()
