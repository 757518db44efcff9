"""What policies need: declared as attributes, carried as one value."""

import json
from dataclasses import asdict, fields
from types import SimpleNamespace

import pytest

from roboirg.core.errors import InvalidValueError, UnknownNameError
from roboirg.core.policy_needs import PolicyNeeds
from roboirg.envs.env_settings import EnvSettings
from roboirg.policies import play
from roboirg.policies.planners.hierarchical_policy import HierarchicalPolicy


class Demanding:
    """A policy with needs that are all different from the defaults."""

    cameras = ["wrist", "front"]  # noqa: RUF012 - a policy need not annotate it
    actions = "ee_pose"
    demonstration_frames = 6
    observe_every = 4
    history_cameras = ("wrist",)
    depth = calibration = grounded = lowers_prompt = True
    prompt_tokens = 64
    prompt_added = 3
    tokenizer = "words.model"
    trained_tasks = "PickXtimes", "BinFill"

    def reset(self, instruction, demonstration): ...
    def act(self, observation): ...
    def follow(self, subgoal): ...


class Declares(SimpleNamespace):
    """A planner or a policy that declares what it is given, as attributes."""

    def reset(self, instruction, demonstration): ...
    def plan(self, observation, step): ...
    def act(self, observation): ...
    def follow(self, subgoal): ...


def test_all_needs_of_a_policy_are_read():
    needs = PolicyNeeds.of(Demanding())

    for field in fields(needs):
        assert getattr(needs, field.name) != field.default, field.name
    assert needs.cameras == ("wrist", "front")


def test_needs_survive_json():
    needs = PolicyNeeds.of(Demanding())

    assert PolicyNeeds(**json.loads(json.dumps(asdict(needs)))) == needs


def test_needs_can_be_declared_on_a_policy():
    policy = Demanding()

    PolicyNeeds().declare_on(policy)

    assert PolicyNeeds.of(policy) == PolicyNeeds()


@pytest.mark.parametrize(
    ("needs", "error", "words"),
    [
        ({"cameras": ["back"]}, UnknownNameError, "no camera 'back'"),
        ({"cameras": (), "depth": True}, InvalidValueError, "depth is True, but cameras is"),
        ({"prompt_tokens": 0}, InvalidValueError, "prompt_tokens is 0; it must be a whole number"),
        ({"prompt_tokens": 10**22}, InvalidValueError, "prompt_tokens is 10{22}; it must be"),
        ({"prompt_added": None}, InvalidValueError, "prompt_added is None"),
        ({"trained_tasks": "BinFill"}, InvalidValueError, "trained_tasks is 'BinFill'; it must"),
        ({"touch": True}, TypeError, "touch"),
    ],
)
def test_needs_with_a_wrong_value_are_refused(needs, error, words):
    """Each has one value that its need cannot have; `touch` is no need at all."""
    with pytest.raises(error, match=words):
        PolicyNeeds(**needs)


class Late(Demanding):
    """Knows its actions only once it is made."""

    actions = property(lambda _self: "waypoint")


def test_needs_given_as_properties_are_read_from_objects_and_not_from_classes():
    """The default of a class is joint angles."""
    assert PolicyNeeds.of(Late).actions == "joint_angle"
    assert PolicyNeeds.of(Late()).actions == "waypoint"


def test_single_needs_of_a_policy_can_be_read():
    assert PolicyNeeds.of(Demanding(), "actions") == PolicyNeeds(actions="ee_pose")


def test_a_planner_that_declares_nothing_needs_neither_cameras_nor_video():
    assert PolicyNeeds.of_planner(object()) == PolicyNeeds(cameras=(), demonstration_frames="none")


@pytest.mark.parametrize(
    ("need", "of_planner", "of_policy", "merged"),
    [
        ("cameras", ("front",), ("wrist",), ("front", "wrist")),
        ("demonstration_frames", 4, 6, 2),  # each 4th and each 6th frame are among each 2nd
        ("observe_every", None, 4, 4),
        ("trained_tasks", ("BinFill",), ("PickXtimes", "BinFill"), ("BinFill",)),
        ("actions", "teleport", "ee_pose", "ee_pose"),
        ("prompt_tokens", 7, 64, 64),
        ("tokenizer", "planner.model", "policy.model", "policy.model"),
    ],
)
def test_needs_of_a_planner_and_of_the_policy_behind_it_are_merged(
    need, of_planner, of_policy, merged
):
    """Both get the cameras, frames and observations that either needs, and are trained on the tasks
    that both know. Only the policy acts and reads prompts, so for these its needs count alone.
    """
    planner = Declares(**{need: of_planner})
    policy = Declares(**{need: of_policy})

    both = PolicyNeeds.of(HierarchicalPolicy(planner, policy))

    assert getattr(both, need) == merged


def test_the_history_of_a_planner_s_cameras_is_added_to_that_of_its_policy():
    """A planner reads the past pictures of all its cameras; a policy names those that it reads."""
    planner = Declares(cameras=("front",))
    policy = Declares(cameras=("front", "wrist"), history_cameras=("wrist",))

    both = PolicyNeeds.of(HierarchicalPolicy(planner, policy))

    assert both.history_cameras == ("front", "wrist")


def test_a_planner_with_its_policy_declares_all_needs_merged():
    """The needs of the policy `Demanding` all differ from the defaults, so that none can be
    forgotten unnoticed.
    """
    planner = Declares(cameras=("front",), demonstration_frames=4, trained_tasks=("BinFill",))
    policy = Demanding()

    both = PolicyNeeds.of(HierarchicalPolicy(planner, policy))

    assert both == PolicyNeeds.of(policy).merge(PolicyNeeds.of_planner(planner))


def test_a_policy_that_names_no_trained_tasks_does_not_limit_those_of_the_other():
    assert PolicyNeeds(trained_tasks=("BinFill",)).merge(PolicyNeeds()).trained_tasks == (
        "BinFill",
    )


def test_a_tokenizer_object_is_refused_where_its_tokens_would_be_counted():
    policy = Demanding()
    policy.tokenizer = object()

    with pytest.raises(InvalidValueError, match="tokenizer is <object"):
        PolicyNeeds.of(policy)


def test_a_policy_is_not_played_in_an_environment_with_other_actions():
    with pytest.raises(InvalidValueError, match="needs actions='ee_pose'"):
        play(SimpleNamespace(actions="waypoint"), Demanding())


def test_the_environment_has_an_option_for_each_of_its_needs():
    options = PolicyNeeds.of(Demanding()).env_options

    made = asdict(EnvSettings.of(options))

    assert {**made, **made["environment"]}.items() >= options.items()
