"""Attribution of episodes that the simulator has played."""

from __future__ import annotations

import pytest
from cause_making import CLOSED, Hands
from selection import slow_but

import roboirg
from roboirg.core.conditions import Fact
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
    """Grounding: it acts well, on what the words do not mean.

    But nobody sees that a later visit of StopCube's cube was meant, or that a container in the air
    was meant alone. A goal that includes more than the right one succeeds on the way.
    """
    other_kinds = {"StopCube": "undecided", "VideoUnmaskSwap": "execution"}
    episode = get_episode(task, "test", 3)
    others = [goal for goal in get_task(task).goals(episode.scene) if goal != episode.goal]
    for goal in {others[0], others[-1]}:
        env = roboirg.make(episode, cameras=(), max_steps=1000)

        info = play(env, OracleWithAnotherGoal(goal))

        found = attribution_of(env, info)
        succeeds = begins_with(with_goal(episode, goal).stages, episode.stages)
        assert info["is_success"] == succeeds, goal
        assert (found is None) == succeeds, goal
        if not succeeds:
            assert info["cause"] is not None, goal
            assert found.kind in ("grounding", other_kinds.get(task)), goal


GREEN_ON_THE_RIGHT = get_episode("PickXtimes", "train", 39)
"""The goal is the green cube, all the way on the right; the red one is all the way on the left."""


@pytest.fixture(scope="module")
def pick_of_the_red_cube():
    """Play the episode with the red cube in mind; return the environment and its last info."""
    env = roboirg.make(GREEN_ON_THE_RIGHT, setting="spatial", cameras=())
    return env, play(env, OracleWithAnotherGoal(Goal.of(color="red", repeats=5)))


def test_the_mirrored_object_of_words_is_meant_with_left_and_right_exchanged():
    """The words mean the green cube, all the way on the right. With the sides exchanged they mean
    the red one, all the way on the left."""
    mirrored = mirrored_objects(GREEN_ON_THE_RIGHT, instruct(GREEN_ON_THE_RIGHT, "spatial"))

    assert mirrored == {"cube_green": {"cube_red"}}


def test_picking_the_cube_on_the_opposite_side_is_called_a_mirrored_pick(pick_of_the_red_cube):
    """The words mean the green cube on the right; the fixture is a play in which the red one on the
    left was picked. `mirrored` says which object they mean with the sides exchanged."""
    mirrored = {"cube_green": frozenset({"cube_red"})}

    found = attribution_of(*pick_of_the_red_cube, mirrored)

    assert (found.kind, found.failure, found.subject) == ("grounding", "mirrored_pick", "cube_red")
    assert found.sentence.endswith("; the words mean it only with left and right exchanged.")


def test_a_pick_on_the_opposite_side_is_just_a_wrong_object_if_no_mirrored_one_is_known(
    pick_of_the_red_cube,
):
    """The words mean the green cube on the right; the fixture is a play in which the red one on the
    left was picked. Without `mirrored` nobody knows that the red one is its mirror image."""
    assert attribution_of(*pick_of_the_red_cube).failure == "wrong_object"


def test_a_closed_hand_that_shoves_a_cube_along_the_table_pushes_it():
    """The green cube, 4 cm wide, is meant. The hand comes down 10 cm in front of its middle and
    goes 4 cm past it, so the cube moves by several centimeters without being held."""
    hands = Hands(get_episode("PickXtimes", "test", 0), 1000)
    x, y, _ = hands.at("cube_green")

    hands.grip(CLOSED)
    for point in [(x - 0.1, y, 0.2), (x - 0.1, y, 0.03), (x + 0.04, y, 0.03)]:
        hands.go(point)

    assert Fact("pushed", "cube_green") in {event.fact for event in hands.env.attempts}
