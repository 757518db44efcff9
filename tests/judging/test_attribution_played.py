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
from roboirg.tasks import every_task, get_task
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


def attribution_of_a_play_for(goal, episode):
    """Return what it is attributed to if the oracle's hands play an episode for another goal."""
    env = roboirg.make(episode, cameras=(), max_steps=1000)
    return attribution_of(env, play(env, OracleWithAnotherGoal(goal)))


TASKS_WITH_HIDDEN_GOALS = ("StopCube", "VideoUnmaskSwap")
OTHER_TASKS = [task for task in every_task() if task not in TASKS_WITH_HIDDEN_GOALS]


@pytest.mark.parametrize(
    "task", slow_but(["PickXtimes", "VideoUnmask", "VideoRepick", "PutInBox"], OTHER_TASKS)
)
def test_an_oracle_that_pursues_a_wrong_goal_fails_by_grounding(task):
    """The oracle's hands act well, but for a goal that the words do not mean, such as another color
    or number. Of all such goals of a scene the first and the last one are played. StopCube and
    VideoUnmaskSwap, where acts do not always show the goal, have a test of their own."""
    episode = get_episode(task, "test", 3)
    goals = get_task(task).goals(episode.scene)
    wrong_goals = [goal for goal in goals if goal != episode.goal]

    for goal in {wrong_goals[0], wrong_goals[-1]}:
        assert attribution_of_a_play_for(goal, episode).kind == "grounding", goal


@pytest.mark.slow
@pytest.mark.parametrize(
    ("task", "goal", "kind"),
    [
        # The cube is to be stopped at its second visit, at the end of which the verdict falls.
        # Waiting for a later one looks like having stopped.
        ("StopCube", Goal.of(visit=3), "undecided"),
        ("StopCube", Goal.of(visit=5), "undecided"),
        # The containers over the green and the blue cube are meant. To hold up the green cube's
        # alone is a right beginning that takes too long.
        ("VideoUnmaskSwap", Goal.of(colors=("green",)), "execution"),
        ("VideoUnmaskSwap", Goal.of(colors=("red", "blue")), "grounding"),
    ],
)
def test_a_wrong_goal_that_acts_do_not_show_is_no_grounding_failure(task, goal, kind):
    """The oracle's hands act well for a goal that the words do not mean. An attribution sees acts,
    not intentions, so it is only of grounding if an act fits no right plan, such as a lift of the
    red cube's container."""
    episode = get_episode(task, "test", 3)

    assert attribution_of_a_play_for(goal, episode).kind == kind


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
