"""LeRobot's environment without LeRobot: the video, the end, and actions that are none."""

import numpy as np
import pytest

from roboirg.apps.integrations.lerobot.sub_environment import NEW_ROLLOUT, LeRobotSubEnvironment
from roboirg.language import instruct
from roboirg.simulation.physics_settings import HOME_ACTION
from roboirg.tasks.splits.splits import get_episode

pytestmark = pytest.mark.sim

FRAMES = 4


def reset(**options):
    env = LeRobotSubEnvironment(
        "VideoUnmask", cameras=("front",), size=32, max_steps=2, video_frames=FRAMES, **options
    )
    return env, *env.reset(seed=51)


def test_the_video_comes_first_and_the_end_is_repeated():
    env, first, info = reset(video="stream")
    hold = np.append(first["agent_pos"][:7], 1.0)
    played = [(first, 0.0, False, False, info)]
    while played[-1][4]["is_video_demo"]:
        played.append(env.step(hold))
    *video, turn = (one["pixels"]["front"] for one, *_ in played)
    later = [env.step(hold) for _ in range(3)]
    assert [one[2:4] for one in later] == [(False, False), (False, True), (False, True)]
    assert env.reset() == (later[1][0], later[1][4])

    _, seen, info = reset(video="key")
    places = np.linspace(0, len(video) - 1, FRAMES).round().astype(int)
    assert np.array_equal(seen["demonstration"], [video[place] for place in places])
    assert seen["demonstration_steps"].tolist() == [len(video)]
    assert np.array_equal(seen["pixels"]["front"], turn)


def test_an_action_that_is_none_ends_the_episode_until_a_reset_is_meant():
    env, *_ = reset()
    ended = env.step(np.full(8, np.nan))
    assert ended[1:] == (0.0, True, False, {"is_success": False, "is_video_demo": False})
    assert env.step(np.zeros(8)) is ended
    assert env.task == instruct(get_episode("VideoUnmask", "test", 1)).text
    env.reset(options={NEW_ROLLOUT: True})
    assert env.step(HOME_ACTION) is not ended
