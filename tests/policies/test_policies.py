"""The built-in policies, and policies made from names."""

import math
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
    policy = make_policy(name, 3)
    assert isinstance(policy, Policy)
    assert isinstance(policy, PrivilegedPolicy) == (name != "random")


def test_costs_that_are_unknown_or_beyond_reason_are_left_out_of_a_record():
    """Also one that no float can hold; and what is unknown in a part makes the sum unknown."""
    planner = SimpleNamespace(usage=lambda: {"calls": 1, "input_tokens": math.nan})
    policy = SimpleNamespace(usage=lambda: {"calls": 1, "input_tokens": 5, "x": 10**400, "y": -1})
    # 1 and 1 calls; tokens, x and y are left out.
    assert policy_usage(PlannerParts(planner, policy)) == {"calls": 2.0}


def test_random_actions_are_valid_and_depend_on_seed_and_instruction_alone():
    observation = {"joint_positions": np.array([0, 0, 0, -1.57, 0, 1.57, 0.78], np.float32)}

    def walk(seed, instruction="Go."):
        policy = make_policy("random", seed)
        policy.reset(instruction, {})
        return np.concatenate([policy.act(observation) for _ in range(20)])

    actions = walk(1)

    assert ((actions >= JOINT_ANGLE.low) & (actions <= JOINT_ANGLE.high)).all()
    assert np.array_equal(check_chunk(actions), actions)
    assert np.array_equal(walk(1), actions)
    assert not np.array_equal(walk(2), actions)
    assert not np.array_equal(walk(1, "Stop."), actions)


@pytest.mark.parametrize(
    ("completed", "executed"),
    [
        # What handles the thing that was not picked begins with the pick; what fails before, alone.
        ([1, 1, 2, 2, 2, 3], "hover pick_cube pick_cube drop_into pick_cube drop_into"),
        ([0, 0, 0, 0], "hover hover hover hover"),
    ],
)
def test_the_expert_repeats_a_failed_motion_at_most_three_times(monkeypatch, completed, executed):
    """`completed` is how many stages are complete each time that it looks."""
    kinds = ("hover", "pick_cube", "drop_into")
    stages = tuple(SimpleNamespace(primitive=Primitive(kind, "cube")) for kind in kinds)
    primitives = SimpleNamespace(execute=lambda primitive: [primitive.kind])
    counts = iter(completed)
    monkeypatch.setattr(scripted, "completed_stages", lambda *_: next(counts))

    chunks = scripted._execute(MagicMock(), stages, primitives)

    assert " ".join(chunk for _, chunk in chunks) == executed


@pytest.mark.parametrize(
    ("task", "numbers"),
    [("VideoUnmask", (0, 49)), ("PickXtimes", (1, 0)), ("PickXtimes", (5,))],
)
def test_the_policy_previous_goal_takes_the_goal_of_the_episode_before(task, numbers):
    """Numbers are the episode's, then the one's whose goal is taken, or none."""
    episode, *before = (get_episode(task, "test", number) for number in numbers)
    goal = PreviousGoalPolicy().decide(SimpleNamespace(episode=episode), "")
    assert goal == (before[0].goal if before else None)


class Silent:
    """A policy without a seed."""

    def reset(self, instruction, demonstration):
        pass

    def act(self, observation):
        return np.zeros((1, 8))


class Deaf:
    """Not a policy: it never acts."""

    def reset(self, instruction, demonstration):
        pass


class OldReset(Silent):
    """Has another signature."""

    def reset(self):
        pass


class Numb(Silent):
    """Cannot be asked to act."""

    act = 3


@pytest.mark.parametrize(
    ("spec", "error", "words"),
    [
        ("orcale", UnknownNameError, "Did you mean 'oracle'"),
        ("no_such_package.policy:It", InvalidValueError, "cannot be imported: .*; modules in '"),
        (f"{__name__}:Silnet", InvalidValueError, r"no class 'Silnet'; it has .*Silent"),
        (
            f"{__name__}:OldReset",
            InvalidValueError,
            r"OldReset\.reset\(self\) must take instruction and demonstration",
        ),
        (f"{__name__}:Deaf", InvalidValueError, r"no method act\(\)"),
        (
            "json:loads",
            InvalidValueError,
            "module json has no class 'loads'; it has JSONDecoder",
        ),
        (f"{__name__}:Numb", InvalidValueError, r"class Numb has no method act\(\)"),
    ],
)
def test_a_wrong_policy_name_is_refused_with_what_would_be_right(spec, error, words):
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
        ("depth", 1, "depth is 1; it must be True or False"),
    ],
)
def test_a_policy_that_declares_a_wrong_need_is_refused_when_it_is_looked_up(
    monkeypatch, attribute, wish, words
):
    """Needs are attributes such as the cameras that a policy wants."""
    monkeypatch.setattr(Silent, attribute, wish, raising=False)
    with pytest.raises(InvalidValueError, match=f"{__name__}:Silent'.*{words}"):
        find_policy(f"{__name__}:Silent")


def guesses_in(setting, count):
    env = roboirg.make("VideoUnmask", setting=setting, episode=0, cameras=())
    assert ListenerPolicy().decide(env, env.instruction.text) == env.episode.goal
    return [ForgetfulPolicy(seed).decide(env, env.instruction.text) for seed in range(count)]


@pytest.mark.sim
def test_the_forgetful_policy_guesses_evenly_among_goals_that_fit_the_words():
    """An explicit command leaves one goal, a direct one without its introduction leaves three."""
    assert set(guesses_in("explicit", 20)) == {get_episode("VideoUnmask", "test", 0).goal}

    guesses = guesses_in("direct", 300)
    counts = {guess: guesses.count(guess) for guess in guesses}
    assert len(counts) == 3
    # 100 expected each; five standard deviations of a fair draw are 41.
    assert all(59 <= count <= 141 for count in counts.values())
