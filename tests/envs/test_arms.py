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


def env_with_another_goal(task="PickXtimes", episode=2, **options):
    """Return an environment of a test episode in the arm *other-goal*: the words state another goal
    of the scene than the original one. It gives two verdicts, "verdict" on the stated goal and
    "original" on the original one."""
    return roboirg.make(task, episode=episode, cameras=(), arm="other-goal", **options)


def test_arms_change_words_and_nothing_that_is_seen():
    """An arm is a way to play a scene for a comparison, such as with the words of another goal. In
    each arm the first picture, the video and the world's state, as bytes, must be the same, so that
    the set has one element."""
    seen = set()
    for arm in ("told", "paraphrase-1", *(name for name in ARMS if name != "paraphrase")):
        env = roboirg.make("VideoUnmask", episode=2, setting="direct", arm=arm, meshes="light")
        observation, info = env.reset()
        picture = observation["front_rgb"].tobytes()
        video = np.asarray(info["demonstration"]["front_rgb"]).tobytes()
        seen.add((picture, video, env.session.state_numbers().tobytes()))
        env.close()

    assert len(seen) == 1


def test_an_episode_with_another_goal_ends_when_the_original_goal_would_have_been_reached():
    """The policy *habit* does the scene's original goal, whatever is said. That it has failed the
    stated goal is certain long before, but the episode goes on: for as many steps as where the
    original goal is stated, the arm *told*."""
    habit = make_policy("habit", seed=0)

    other_goal = play(env_with_another_goal("PickXtimes", 2), habit)
    told = play(roboirg.make("PickXtimes", episode=2, cameras=()), habit)

    assert other_goal["steps"] == told["steps"]


def test_between_the_verdict_and_the_end_the_episode_goes_on():
    """The policy *habit* does the scene's original goal, and so fails the stated one: the verdict
    falls in the middle of a chunk of actions. The chunk is executed whole, all steps count, and
    nothing tells the policy that it has failed until the original goal is decided, too."""
    env = env_with_another_goal("PickXtimes", 2)
    policy = make_policy("habit", seed=0)
    observation, info = EpisodeLoop(env, policy).begin()
    steps = 0

    while info["verdict"] == "ongoing":
        chunk = policy.act(observation)
        steps += len(chunk)
        observation, reward, terminated, truncated, info = env.step_chunk(chunk)

    assert (info["status"], info["verdict"]) == ("ongoing", "failure")
    assert (info["steps"], info["cause"]) == (steps, None)
    assert (reward, terminated, truncated) == (0.0, False, False)


def test_a_success_stays_one_while_the_original_goal_is_undecided():
    """In test episode 6 of StopCube the words of the arm *other-goal* state an earlier visit of the
    moving cube than the original goal. The oracle stops it then, which is a success for the words
    (the verdict); but the original goal is not decided yet, so the episode goes on. It ends when
    that has failed, with the verdict as its status."""
    env = env_with_another_goal("StopCube", 6)
    loop = EpisodeLoop(env, make_policy("oracle", seed=0))
    observation, at_verdict = loop.begin()
    while at_verdict["verdict"] == "ongoing":
        observation, at_verdict = loop.execute(loop.act(observation))

    at_the_end = loop.take_turns(observation, at_verdict)

    assert (at_verdict["verdict"], at_verdict["original"]) == ("success", "ongoing")
    assert (at_verdict["status"], at_verdict["is_success"]) == ("ongoing", False)
    assert (at_the_end["status"], at_the_end["original"]) == ("success", "failure")
    assert at_the_end["cause"] is None


def test_time_ends_an_episode_whose_original_goal_is_undecided():
    """The words state another goal, which the policy *habit* fails by doing the original one. That
    takes more than the 150 steps that are allowed, so the original goal stays undecided."""
    env = env_with_another_goal("PickXtimes", 2, max_steps=150)

    info = play(env, make_policy("habit", seed=0))

    assert (info["status"], info["verdict"], info["original"]) == ("failure", "failure", "ongoing")
    assert info["steps"] == 150


def test_a_pose_that_cannot_be_reached_fails_both_goals():
    """The action is a waypoint: a position in meters, a quaternion and the gripper. It is 5 m ahead
    of a robot that reaches less than 1 m, which ends the episode for the stated and the original
    goal."""
    env = env_with_another_goal("PickXtimes", 2, actions="waypoint")
    env.reset()

    *_, terminated, _, info = env.step(np.array([5.0, 0.0, 0.2, 0.0, 0.0, 0.0, 1.0]))

    assert terminated
    assert (info["status"], info["verdict"], info["original"]) == ("failure",) * 3
    assert info["cause"]


def test_a_reset_may_ask_for_another_arm_which_holds_for_that_episode_alone():
    """An arm is a way to play a scene for a comparison. In *other-goal* the words state another
    goal; the environment knows the original words, and gives a second verdict. The next reset is
    without an arm again."""
    env = roboirg.make("PickXtimes", episode=2, cameras=())

    _, info = env.reset(options={"arm": "other-goal"})
    assert "verdict" in info
    assert env.original != env.instruction.text

    _, info = env.reset()
    assert "verdict" not in info
    assert env.original is None


def test_an_unknown_arm_is_refused_with_the_nearest_name():
    with pytest.raises(UnknownNameError, match="other-goal"):
        roboirg.make("PickXtimes", arm="othergoal")
