"""The built-in policies, and policies made from names."""

import math
from collections import Counter
from types import SimpleNamespace
from unittest.mock import MagicMock

import numpy as np
import pytest

import roboirg
from roboirg.core.actions import JOINT_ANGLE, check_chunk
from roboirg.core.episode import Primitive
from roboirg.core.errors import InvalidValueError, UnknownNameError
from roboirg.policies import Policy, PrivilegedPolicy, find_policy, make_policy
from roboirg.policies.builtin import BUILTIN, scripted
from roboirg.policies.builtin.listeners import ForgetfulPolicy, ListenerPolicy
from roboirg.policies.builtin.oracle_policy import PreviousGoalPolicy
from roboirg.policies.contract.policy_calls import policy_usage
from roboirg.policies.planners.hierarchical_policy import PlannerParts
from roboirg.tasks.splits.splits import get_episode


@pytest.mark.parametrize("name", BUILTIN)
def test_built_in_policies_have_the_methods_of_a_policy(name):
    """All but "random" are privileged: they read the simulator, as no robot could."""
    policy = make_policy(name, 3)
    assert isinstance(policy, Policy)
    assert isinstance(policy, PrivilegedPolicy) == (name != "random")


def test_costs_that_are_unknown_or_beyond_reason_are_left_out_of_a_record():
    """The parts' costs are summed: 1 and 1 calls make 2.

    Left out are tokens, as those of the planner are unknown (NaN); x, which no float can hold; and
    the negative y.
    """
    planner = SimpleNamespace(usage=lambda: {"calls": 1, "input_tokens": math.nan})
    policy = SimpleNamespace(usage=lambda: {"calls": 1, "input_tokens": 5, "x": 10**400, "y": -1})
    # 1 and 1 calls; tokens, x and y are left out.
    assert policy_usage(PlannerParts(planner, policy)) == {"calls": 2.0}


def random_walk(seed, instruction):
    """Return 20 actions of the random policy, (20, 8), from the arm's usual pose."""
    policy = make_policy("random", seed)
    policy.reset(instruction, {})
    pose = np.array([0, 0, 0, -1.57, 0, 1.57, 0.78], np.float32)
    return np.concatenate([policy.act({"joint_positions": pose}) for _ in range(20)])


def test_random_actions_are_valid():
    """20 chunks of the policy "random", seed 1: joint angles within the arm's limits."""
    actions = random_walk(1, "Go.")

    assert ((actions >= JOINT_ANGLE.low) & (actions <= JOINT_ANGLE.high)).all()
    assert np.array_equal(check_chunk(actions), actions)


def test_random_actions_depend_on_seed_and_instruction_alone():
    """Seed 1 and *Go.* give the same actions again; seed 2 or *Stop.* give others."""
    actions = random_walk(1, "Go.")

    assert np.array_equal(random_walk(1, "Go."), actions)
    assert not np.array_equal(random_walk(2, "Go."), actions)
    assert not np.array_equal(random_walk(1, "Stop."), actions)


def motions_executed(monkeypatch, stages, *, complete_after_each):
    """Return the kinds of motions that the scripted expert executes, in their order.

    Args:
        monkeypatch: pytest's.
        stages: kinds of motions of the goal, in the order in which they are to be done.
        complete_after_each: how many of the stages the simulator finds complete after each motion.
    """
    planned = [SimpleNamespace(primitive=Primitive(kind, "cube")) for kind in stages]
    primitives = SimpleNamespace(execute=lambda primitive: [primitive.kind])
    counts = iter(complete_after_each)
    monkeypatch.setattr(scripted, "completed_stages", lambda *_: next(counts))
    return [motion for _, motion in scripted._execute(MagicMock(), planned, primitives)]


def test_the_expert_picks_up_again_what_it_failed_to_put_down(monkeypatch):
    """The expert does hover, pick and drop, and the simulator says after each motion how many of
    the three are complete.

    A failed pick is repeated alone. A failed drop cannot be: the cube is no longer in the gripper,
    so it is picked up again first.
    """
    motions = motions_executed(
        monkeypatch,
        stages=["hover", "pick_cube", "drop_into"],
        complete_after_each=[1, 1, 2, 2, 2, 3],
    )

    assert motions == [
        "hover",  # 1 complete
        "pick_cube",  # still 1: it failed
        "pick_cube",  # 2 complete
        "drop_into",  # still 2: it failed
        "pick_cube",  # 2 complete, again
        "drop_into",  # all 3
    ]


def test_the_expert_gives_up_after_three_repetitions_of_a_failed_motion(monkeypatch):
    """No stage is ever complete: the first is tried once and repeated three times."""
    motions = motions_executed(
        monkeypatch, stages=["hover", "pick_cube"], complete_after_each=[0, 0, 0, 0]
    )

    assert motions == ["hover", "hover", "hover", "hover"]


@pytest.mark.parametrize(
    ("task", "number", "before"),
    [("VideoUnmask", 0, 49), ("PickXtimes", 1, 0)],
    ids=["the last one before the first", "the one before"],
)
def test_the_policy_previous_goal_takes_the_goal_of_the_episode_before(task, number, before):
    """It is a blind baseline. A split has 50 episodes, so before number 0 comes number 49."""
    env = SimpleNamespace(episode=get_episode(task, "test", number))

    assert PreviousGoalPolicy().decide(env, "") == get_episode(task, "test", before).goal


def test_the_policy_previous_goal_gives_up_if_the_scene_lacks_that_goal():
    env = SimpleNamespace(episode=get_episode("PickXtimes", "test", 5))

    assert PreviousGoalPolicy().decide(env, "") is None


class PolicyWithoutSeed:
    """A policy that stands still."""

    def reset(self, instruction, demonstration):
        pass

    def act(self, observation):
        return np.zeros((1, 8))


class PolicyWithoutAct:
    """Not a policy: it never acts."""

    def reset(self, instruction, demonstration):
        pass


class PolicyWithoutArguments(PolicyWithoutSeed):
    """Its reset has another signature."""

    def reset(self):
        pass


@pytest.mark.parametrize(
    ("spec", "error", "words"),
    [
        ("orcale", UnknownNameError, "Did you mean 'oracle'"),
        ("no_such_package.policy:It", InvalidValueError, "cannot be imported: .*; modules in '"),
        (f"{__name__}:PolicyWithout", InvalidValueError, "no class 'PolicyWithout'; it has .*Seed"),
        (f"{__name__}:PolicyWithoutArguments", InvalidValueError,
         r"Arguments\.reset\(self\) must take instruction and demonstration"),
        (f"{__name__}:PolicyWithoutAct", InvalidValueError, r"no method act\(\)"),
        ("json:loads", InvalidValueError, "json has no class 'loads'; it has JSONDecoder"),
    ],
    ids=["misspelled", "no module", "no class", "other signature", "no act", "no class at all"],
)  # fmt: skip
def test_a_wrong_policy_name_is_refused_with_what_would_be_right(spec, error, words):
    """The classes PolicyWithout… are those of this file: one without a method act(), and one whose
    reset() takes no arguments.
    """
    with pytest.raises(error, match=words):
        find_policy(spec)


@pytest.mark.parametrize(
    ("attribute", "wish", "words"),
    [
        ("cameras", "front", r"write \('front',\)"),
        ("cameras", ("front", "wirst"), r"Did you mean 'wrist'\?"),
        ("cameras", ("front", "front"), "names 'front' twice"),
        ("actions", "way_point", r"no action space 'way_point'.*Did you mean 'waypoint'\?"),
        ("demonstration_frames", "some", "demonstration_frames is 'some'; it must be 'all', 'no"),
        ("observe_every", -1, "observe_every is -1; it must be a whole number from 1"),
    ],
)
def test_a_policy_that_declares_a_wrong_need_is_refused_when_it_is_looked_up(
    monkeypatch, attribute, wish, words
):
    """Needs are attributes such as the cameras that a policy wants."""
    monkeypatch.setattr(PolicyWithoutSeed, attribute, wish, raising=False)

    with pytest.raises(InvalidValueError, match=f"{__name__}:PolicyWithoutSeed'.*{words}"):
        find_policy(f"{__name__}:PolicyWithoutSeed")


@pytest.fixture(scope="module")
def video_unmask():
    """Make the first test episode in a setting: its goal is one container of three."""

    def make(setting):
        return roboirg.make("VideoUnmask", setting=setting, episode=0, cameras=())

    return make


def guesses_in(env, count):
    """Return the goals that the forgetful policy chooses with so many seeds."""
    return [ForgetfulPolicy(seed).decide(env, env.instruction.text) for seed in range(count)]


@pytest.mark.sim
def test_the_listener_and_the_forgetful_policy_do_what_an_explicit_command_says(video_unmask):
    env = video_unmask("explicit")

    assert ListenerPolicy().decide(env, env.instruction.text) == env.episode.goal
    assert set(guesses_in(env, 20)) == {env.episode.goal}


@pytest.mark.sim
def test_the_forgetful_policy_guesses_evenly_among_goals_that_fit_the_words(video_unmask):
    """A direct command without its introduction leaves three goals: of 300 guesses 100 each.

    Five standard deviations of a fair draw are 41.
    """
    guesses = guesses_in(video_unmask("direct"), 300)

    counts = Counter(guesses)
    assert len(counts) == 3
    assert 59 <= min(counts.values()) <= max(counts.values()) <= 141
