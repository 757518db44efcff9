"""The built-in policies, and how a name becomes one."""

import numpy as np
import pytest

import roboirg
from roboirg.actions import ACTION_HIGH, ACTION_LOW, check_chunk
from roboirg.errors import InvalidValueError, UnknownNameError
from roboirg.policies import Policy, PrivilegedPolicy, load_policy_class, make_policy
from roboirg.policies.listeners import ForgetfulPolicy, ListenerPolicy
from roboirg.policies.loading import BUILTIN
from roboirg.tasks import all_tasks


@pytest.mark.parametrize("name", BUILTIN)
def test_built_in_policies_fulfil_the_contract(name):
    policy = make_policy(name, 3)
    assert isinstance(policy, Policy)
    assert isinstance(policy, PrivilegedPolicy) == (name != "random")


def test_random_actions_are_valid_and_depend_on_seed_and_instruction_alone():
    observation = {"joint_positions": np.array([0, 0, 0, -1.57, 0, 1.57, 0.78], np.float32)}

    def walk(seed, instruction="Go."):
        policy = make_policy("random", seed)
        policy.reset(instruction, {})
        return np.concatenate([policy.act(observation) for _ in range(20)])

    actions = walk(1)
    assert ((actions >= ACTION_LOW) & (actions <= ACTION_HIGH)).all()
    assert np.array_equal(check_chunk(actions), actions)
    assert np.array_equal(walk(1), actions)
    assert not np.array_equal(walk(2), actions)
    assert not np.array_equal(walk(1, "Stop."), actions)


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


def test_own_policies_are_named_by_import_path():
    assert isinstance(make_policy(f"{__name__}:Silent", 0), Silent)


@pytest.mark.parametrize(
    ("spec", "error", "words"),
    [
        ("orcale", UnknownNameError, "Did you mean 'oracle'"),
        ("no_such_package.policy:It", InvalidValueError, "cannot be imported"),
        ("roboirg.policies.random:Missing", InvalidValueError, "no class 'Missing'"),
        (f"{__name__}:Deaf", InvalidValueError, r"no method act\(\)"),
        (f"{__name__}:pytest", InvalidValueError, "no class 'pytest'"),
    ],
)
def test_wrong_specs_are_explained(spec, error, words):
    with pytest.raises(error, match=words):
        load_policy_class(spec)


def test_a_module_that_breaks_is_named_with_what_broke(tmp_path, monkeypatch):
    (tmp_path / "broken_policy.py").write_text("1 / 0\n")
    monkeypatch.syspath_prepend(tmp_path)
    with pytest.raises(InvalidValueError, match=r"broken_policy.*ZeroDivisionError"):
        load_policy_class("broken_policy:It")


def decided(policy_class, task, setting, episode, seed=0):
    env = roboirg.make(task, setting=setting, episode=episode, cameras=())
    return policy_class(seed).decide(env, env.instruction.text), env.episode.goal


@pytest.mark.sim
@pytest.mark.parametrize("task", all_tasks())
def test_the_listener_always_understands(task):
    for setting in all_tasks()[task].settings:
        for episode in range(12):
            heard, meant = decided(ListenerPolicy, task, setting, episode)
            assert heard == meant


@pytest.mark.sim
@pytest.mark.parametrize("task", all_tasks())
def test_the_forgetful_listener_understands_what_is_explicit_and_guesses_the_rest(task):
    for setting in all_tasks()[task].settings:
        pairs = [
            decided(ForgetfulPolicy, task, setting, episode, seed)
            for episode in range(12)
            for seed in range(5)
        ]
        right = np.mean([heard == meant for heard, meant in pairs])
        if setting == "explicit":
            assert right == 1.0
        else:
            assert 0.0 < right < 0.8


@pytest.mark.sim
def test_guesses_are_uniform_over_the_goals_that_fit():
    guesses = [decided(ForgetfulPolicy, "VideoUnmask", "direct", 0, seed)[0] for seed in range(300)]
    counts = {guess: guesses.count(guess) for guess in guesses}
    assert len(counts) == 3
    # 100 expected each; five standard deviations of a fair draw are 41.
    assert all(59 <= count <= 141 for count in counts.values())
