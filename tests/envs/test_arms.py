"""Control arms in the environment: what changes, and when an episode with another goal ends."""

from __future__ import annotations

import numpy as np
import pytest

import roboirg
from roboirg.core.arms import ARMS
from roboirg.core.errors import UnknownNameError
from roboirg.policies import make_policy, play
from roboirg.policies.contract.play import EpisodeLoop

pytestmark = pytest.mark.sim


def make(task="PickXtimes", episode=2, **options):
    """Return an environment whose instruction states another goal than the scene's original."""
    return roboirg.make(task, episode=episode, cameras=(), arm="other-goal", **options)


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


def test_a_policy_that_does_the_original_goal_although_another_was_stated_is_seen_to_do_it():
    """The policy *habit* does so. Its verdict is on the stated goal, *original* on the other."""
    info = play(make(), make_policy("habit", seed=0))

    assert (info["status"], info["verdict"], info["original"]) == ("failure", "failure", "success")
    assert "picked up" in info["cause"]


def test_an_episode_with_another_goal_ends_when_the_original_goal_would_have_been_reached():
    """Not with the failure that is certain before."""
    other_goal = play(make(), make_policy("habit", seed=0))

    told = play(roboirg.make("PickXtimes", episode=2, cameras=()), make_policy("habit", seed=0))

    assert other_goal["steps"] == told["steps"]


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


def test_a_reset_may_ask_for_another_arm_which_holds_for_that_episode_alone():
    """In the arm *other-goal* the environment knows the original words, and gives two verdicts."""
    env = roboirg.make("PickXtimes", episode=2, cameras=())

    _, info = env.reset(options={"arm": "other-goal"})
    assert "verdict" in info
    assert env.original is not None
    assert env.instruction.text != env.original

    _, info = env.reset()
    assert "verdict" not in info
    assert env.original is None


def test_an_unknown_arm_is_refused_with_the_nearest_name():
    with pytest.raises(UnknownNameError, match="other-goal"):
        roboirg.make("PickXtimes", arm="othergoal")
