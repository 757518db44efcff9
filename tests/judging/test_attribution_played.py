"""Attribution of episodes that the simulator has played."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import pytest
from selection import slow_but

import roboirg
from roboirg.core.conditions import Fact
from roboirg.core.episode import SPLITS, Goal
from roboirg.envs.environment import RoboIRGEnv
from roboirg.judging import FailureAttribution, attribute_failure
from roboirg.language import instruct, mirrored_objects
from roboirg.policies import make_policy, play
from roboirg.policies.builtin.scripted import ScriptedPolicy
from roboirg.tasks import every_task, get_task
from roboirg.tasks.splits.splits import get_episode, split_episodes

pytestmark = pytest.mark.sim


def finding(
    env: RoboIRGEnv, info: dict[str, Any], mirrored: Mapping[str, frozenset[str]] | None = None
) -> FailureAttribution | None:
    return attribute_failure(
        env.episode,
        env.events,
        timed_out=env.status == "timeout",
        policy_start_step=info["elapsed_steps"] - info["steps"],
        elapsed_steps=info["elapsed_steps"],
        cause=info["cause"],
        mirrored=mirrored,
        attempts=env.attempts,
    )


UNSEEN = {"StopCube": "undecided", "VideoUnmaskSwap": "execution"}
"""Nobody sees that a later visit was meant, or that a container in the air was meant alone."""


class Mistaken(ScriptedPolicy):
    """The oracle's hands with another goal in mind."""

    def __init__(self, goal: Goal) -> None:
        super().__init__()
        self.goal = goal

    def decide(self, env: RoboIRGEnv, instruction: str) -> Goal:
        return self.goal


@pytest.mark.parametrize(
    "task", slow_but(["PickXtimes", "VideoUnmask", "VideoRepick", "PutInBox"], every_task())
)
def test_hands_that_do_another_task_well_fail_by_grounding(task: str) -> None:
    episode = get_episode(task, "test", 3)
    others = [goal for goal in get_task(task).goals(episode.scene) if goal != episode.goal]
    for goal in {others[0], others[-1]}:
        env = roboirg.make(episode, cameras=(), max_steps=1000)
        info = play(env, Mistaken(goal))
        found = finding(env, info)
        # A goal that includes more than the right one succeeds on the way.
        succeeds = (
            get_task(task).stages(episode.scene, goal)[: len(episode.stages)] == episode.stages
        )
        assert info["status"] in ({"success"} if succeeds else {"failure", "timeout"}), goal
        assert (info["cause"] is None) == (info["status"] == "success") == info["is_success"]
        assert (found is None) == succeeds
        assert found is None or found.kind in ("grounding", UNSEEN.get(task)), (goal, found)


@pytest.mark.parametrize(
    ("task", "episode", "failure", "subject"),
    [
        ("VideoUnmask", 1, "wrong_object", "container"),
        ("PickXtimes", 1, "wrong_count", "cube"),
    ],
)
def test_the_forgetful_listener(task: str, episode: int, failure: str, subject: str) -> None:
    env = roboirg.make(task, setting="contextual", episode=episode, cameras=())
    info = play(env, make_policy("forgetful", 0))
    found = finding(env, info)
    assert found is not None
    assert (found.kind, found.failure) == ("grounding", failure)
    assert str(found.subject).startswith(subject)
    assert found.step == info["steps"]


def test_a_listener_who_takes_left_for_right_picks_the_mirrored_cube() -> None:
    told = ((one, instruct(one, "spatial")) for one in split_episodes(["PickXtimes"], SPLITS))
    episode, said = next(
        (one, words)
        for one, words in told
        if words.metadata["landmarks"] == ["farthest to your left"] and mirrored_objects(one, words)
    )
    mirrored = mirrored_objects(episode, said)
    right = max(episode.scene.of_kind("cube"), key=lambda cube: -cube.position.y)
    assert mirrored == {episode.stages[0].primitive.subject: {right.name}}
    goal = Goal.of(color=str(right.color), repeats=episode.goal.number("repeats"))
    env = roboirg.make(episode, setting="spatial", cameras=())
    info = play(env, Mistaken(goal))
    found = finding(env, info, mirrored)
    assert found is not None
    assert (found.kind, found.failure, found.subject) == ("grounding", "mirrored_pick", right.name)
    assert found.sentence.endswith("; the words mean it only with left and right exchanged.")
    untold = finding(env, info)
    assert untold is not None
    assert untold.failure == "wrong_object"


def test_a_pose_out_of_reach() -> None:
    env = roboirg.make("PickXtimes", episode=0, cameras=(), actions="ee_pose")
    env.reset()
    *_, info = env.step(np.array([5.0, 0.0, 0.2, 3.14, 0.0, 0.0, 1.0]))
    found = finding(env, info)
    assert info["status"] == "failure"
    assert found is not None
    assert found.failure == "unreachable"
    assert str(info["cause"]).rstrip(".") in found.sentence


def test_what_is_picked_is_held_and_was_reached() -> None:
    env = roboirg.make("VideoRepick", episode=1, cameras=())
    play(env, make_policy("oracle", 0))
    cube = env.episode.stages[0].primitive.subject
    begun = [event.fact for event in env.events if event.holds and event.fact.subject == cube]
    kinds = [fact.kind for fact in begun if fact.kind in ("reached", "held", "picked")]
    assert kinds[:3] == ["reached", "held", "picked"]
    ceased = [event for event in env.events if not event.holds]
    assert {Fact("held", cube), Fact("reached", cube)} <= {event.fact for event in ceased}
