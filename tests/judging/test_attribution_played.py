"""Attribution of episodes that the simulator has played."""

from __future__ import annotations

import pytest
from selection import slow_but

import roboirg
from roboirg.core.episode import Goal
from roboirg.judging import attribute_failure
from roboirg.language import instruct, mirrored_objects
from roboirg.policies import play
from roboirg.policies.builtin.scripted import ScriptedPolicy
from roboirg.tasks import every_task, get_task, with_goal
from roboirg.tasks.other_goals import begins_with
from roboirg.tasks.splits.splits import get_episode

pytestmark = pytest.mark.sim


def attribution_of(env, info, mirrored=None):
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


OTHER_KINDS = {"StopCube": "undecided", "VideoUnmaskSwap": "execution"}
"""Nobody sees that a later visit was meant, or that a container in the air was meant alone."""


class OracleWithAnotherGoal(ScriptedPolicy):
    """The oracle's hands with another goal in mind."""

    def __init__(self, goal):
        super().__init__()
        self.goal = goal

    def decide(self, env, instruction):
        return self.goal


@pytest.mark.parametrize(
    "task", slow_but(["PickXtimes", "VideoUnmask", "VideoRepick", "PutInBox"], every_task())
)
def test_an_oracle_that_pursues_a_wrong_goal_fails_by_grounding(task):
    """Grounding: it acts well, on what the words do not mean."""
    episode = get_episode(task, "test", 3)
    others = [goal for goal in get_task(task).goals(episode.scene) if goal != episode.goal]
    for goal in {others[0], others[-1]}:
        env = roboirg.make(episode, cameras=(), max_steps=1000)
        info = play(env, OracleWithAnotherGoal(goal))
        found = attribution_of(env, info)
        # A goal that includes more than the right one succeeds on the way.
        succeeds = begins_with(with_goal(episode, goal).stages, episode.stages)
        assert (info["status"] == "success") == (info["cause"] is None) == succeeds, goal
        assert info["is_success"] == (found is None) == succeeds
        assert found is None or found.kind in ("grounding", OTHER_KINDS.get(task)), (goal, found)


def test_picking_the_cube_on_the_opposite_side_is_called_a_mirrored_pick():
    """The goal is the green cube, all the way on the
    right; the red one is all the way on the left."""
    episode = get_episode("PickXtimes", "train", 39)  # the green cube, all the way on the right
    mirrored = mirrored_objects(episode, instruct(episode, "spatial"))
    assert mirrored == {"cube_green": {"cube_red"}}

    env = roboirg.make(episode, setting="spatial", cameras=())
    info = play(env, OracleWithAnotherGoal(Goal.of(color="red", repeats=5)))
    found = attribution_of(env, info, mirrored)
    assert found is not None
    assert (found.kind, found.failure, found.subject) == ("grounding", "mirrored_pick", "cube_red")
    assert found.sentence.endswith("; the words mean it only with left and right exchanged.")

    # Without knowing which object the words mean mirrored, it is just a wrong one.
    untold = attribution_of(env, info)
    assert untold is not None
    assert untold.failure == "wrong_object"
