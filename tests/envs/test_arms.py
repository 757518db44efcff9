"""Control arms in the environment: what changes, and when an episode with another goal ends."""

from __future__ import annotations

import numpy as np
import pytest

import roboirg
from roboirg.core.arms import ARMS
from roboirg.core.errors import UnknownNameError
from roboirg.envs.environment import RoboIRGEnv
from roboirg.policies import make_policy, play
from roboirg.policies.contract.play import EpisodeLoop

pytestmark = pytest.mark.sim


def make(task: str = "PickXtimes", episode: int = 2, **options: object) -> RoboIRGEnv:
    return roboirg.make(task, episode=episode, cameras=(), arm="other-goal", **options)  # type: ignore[arg-type]


def test_arms_change_words_and_nothing_that_is_seen():
    seen = {}
    for arm in [name for name in ARMS if name != "paraphrase"] + ["paraphrase-1"]:
        env = roboirg.make("VideoUnmask", episode=2, setting="direct", arm=arm, meshes="light")
        observation, info = env.reset()
        video = info["demonstration"]
        seen[arm] = (
            observation["front_rgb"].tobytes(),
            observation["joint_positions"].tobytes(),
            np.asarray(video["front_rgb"]).tobytes(),
            env.session.state_numbers().tobytes(),
        )
        assert (env.original is not None) == (arm == "other-goal")
        env.close()
    assert len(set(seen.values())) == 1


def test_a_policy_that_does_the_usual_thing_is_seen_to_do_it():
    env = make()
    info = play(env, make_policy("habit", seed=0))
    assert (info["status"], info["verdict"], info["original"]) == ("failure", "failure", "success")
    assert "picked up" in info["cause"]

    told = roboirg.make("PickXtimes", episode=2, cameras=())
    assert play(told, make_policy("habit", seed=0))["steps"] == info["steps"]


def test_between_the_verdict_and_the_end_the_episode_goes_on():
    env = make()
    policy = make_policy("habit", seed=0)
    loop = EpisodeLoop(env, policy)
    observation, info = loop.begin()
    after = 0

    while info["status"] == "ongoing":
        before = info["steps"]
        verdict = info["verdict"]
        rows = policy.act(observation)
        observation, reward, terminated, truncated, info = env.step_chunk(rows)
        if info["status"] == "ongoing":
            # A chunk runs over the verdict.
            assert info["steps"] == before + len(rows)
            assert (info["cause"], reward, terminated, truncated) == (None, 0.0, False, False)
            after += verdict == "failure"

    assert after > 3
    assert info["original"] == "success"
    assert terminated


def test_a_success_stays_one_while_the_original_goal_is_undecided():
    env = make("StopCube", 6)  # the other goal is an earlier visit
    loop = EpisodeLoop(env, make_policy("oracle", seed=0))
    observation, info = loop.begin()
    while info["verdict"] == "ongoing":
        observation, info = loop.execute(loop.act(observation))

    assert (info["verdict"], info["original"]) == ("success", "ongoing")
    assert (info["status"], info["is_success"]) == ("ongoing", False)

    info = loop.take_turns(observation, info)
    assert (info["status"], info["original"], info["cause"]) == ("success", "failure", None)


def test_time_ends_an_episode_whose_original_goal_is_undecided():
    env = make(max_steps=150)
    policy = make_policy("habit", seed=0)

    info = play(env, policy)

    assert (info["status"], info["verdict"], info["original"]) == ("failure", "failure", "ongoing")
    assert info["steps"] == 150


def test_a_pose_that_cannot_be_reached_fails_both_goals():
    env = make(actions="waypoint")
    env.reset()

    *_, terminated, _, info = env.step(np.array([5.0, 0.0, 0.2, 0.0, 0.0, 0.0, 1.0]))

    assert terminated
    assert (info["status"], info["verdict"], info["original"]) == ("failure",) * 3
    assert info["cause"]


def test_arms_of_a_reset_and_names_that_do_not_exist():
    env = roboirg.make("PickXtimes", episode=2, cameras=())
    _, info = env.reset(options={"arm": "other-goal"})
    assert env.original is not None
    assert "verdict" in info
    assert env.instruction.text != env.original

    _, info = env.reset()
    assert env.original is None
    assert "verdict" not in info
    with pytest.raises(UnknownNameError, match="other-goal"):
        roboirg.make("PickXtimes", arm="othergoal")
