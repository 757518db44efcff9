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

SIZE = 32


def reset(**options):
    """Return an environment of two steps of VideoUnmask, and what its reset to seed 51 gives."""
    env = LeRobotSubEnvironment(
        "VideoUnmask", cameras=("front",), size=SIZE, max_steps=2, **options
    )
    return env, *env.reset(seed=51)


def test_the_video_comes_first_and_the_end_is_repeated():
    env, first, info = reset(video=True)
    assert set(first) == {"pixels", "agent_pos"}

    hold = np.append(first["agent_pos"][:7], 1.0)
    pictures = [first["pixels"]["front"]]
    while info["is_video_demo"]:
        observation, *_, info = env.step(hold)
        pictures.append(observation["pixels"]["front"])
    *video, turn = pictures
    later, end, after_it = (env.step(hold) for _ in range(3))

    assert later[2:4] == (False, False)
    assert end[2:4] == after_it[2:4] == (False, True)
    assert env.reset() == (end[0], end[4])

    _, info = roboirg.make("VideoUnmask", episode=1, cameras=("front",)).reset()
    shown = info["demonstration"]["front_rgb"]
    assert np.array_equal(video, [scaled_square(picture, SIZE) for picture in shown])
    _, seen, info = reset()
    assert np.array_equal(seen["pixels"]["front"], turn)
    assert not info["is_video_demo"]


def test_an_action_that_is_none_ends_the_episode_until_a_reset_is_meant():
    """An action of NaN ends the episode as a failure; later steps repeat that end.

    Only a reset that says that a new rollout begins starts the next episode.
    """
    env, *_ = reset()
    ended = env.step(np.full(8, np.nan))
    assert ended[1:] == (0.0, True, False, {"is_success": False, "is_video_demo": False})
    assert env.step(np.zeros(8)) is ended
    assert env.task == instruct(get_episode("VideoUnmask", "test", 1)).text

    env.reset(options={NEW_ROLLOUT: True})
    assert env.step(HOME_ACTION) is not ended


def test_batches_report_the_end_where_lerobot_looks_for_it():
    """Two episodes of one step end together, as failures, since the arm only holds still.

    LeRobot 0.4 reads successes from `final_info` alone. Seeds 1000 and 1001 are episodes 0 and 1.
    """
    env = make_batch("StopCube", 2, False, {"cameras": ("front",), "size": SIZE, "max_steps": 1})
    env.reset(seed=[1000, 1001])
    actions = np.tile(HOME_ACTION, (2, 1)).astype(np.float32)
    *_, truncated, infos = env.step(actions)

    assert truncated.all()
    assert infos["final_info"]["is_success"].tolist() == [False, False]

    texts = [instruct(get_episode("StopCube", "test", index)).text for index in (0, 1)]
    assert list(env.call("task_description")) == texts

    env.close()
