"""What policies need: declared as attributes, carried as one value."""

import json
from dataclasses import FrozenInstanceError, asdict, fields
from types import SimpleNamespace

import pytest

from roboirg.core.errors import InvalidValueError, UnknownNameError
from roboirg.core.policy_needs import PolicyNeeds
from roboirg.envs.env_settings import EnvSettings
from roboirg.policies import play
from roboirg.policies.planners.hierarchical_policy import HierarchicalPolicy


class Demanding:
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


class Guide:
    cameras = ("front",)
    demonstration_frames = 4
    trained_tasks = ("BinFill",)

    def reset(self, instruction, demonstration): ...
    def plan(self, observation, step): ...


def test_all_needs_of_a_policy_are_read_and_survive_json():
    needs = PolicyNeeds.of(Demanding())
    assert all(getattr(needs, field.name) != field.default for field in fields(needs))
    assert needs.cameras == ("wrist", "front")
    assert PolicyNeeds(**json.loads(json.dumps(asdict(needs)))) == needs
    with pytest.raises(FrozenInstanceError):
        needs.depth = False

    copy = Demanding()
    PolicyNeeds().declare_on(copy)
    assert PolicyNeeds.of(copy) == PolicyNeeds()


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
    with pytest.raises(error, match=words):
        PolicyNeeds(**needs)


def test_needs_given_as_properties_are_read_from_objects_and_not_from_classes():
    class Late(Demanding):
        actions = property(lambda _self: "waypoint")
        prompt_tokens = property(lambda _self: 9)

    assert (PolicyNeeds.of(Late).actions, PolicyNeeds.of(Late).prompt_tokens) == (
        "joint_angle", None,
    )  # fmt: skip
    assert (PolicyNeeds.of(Late()).actions, PolicyNeeds.of(Late()).prompt_tokens) == (
        "waypoint", 9,
    )  # fmt: skip
    assert PolicyNeeds.of(Late(), "actions") == PolicyNeeds(actions="waypoint")


def test_needs_of_a_planner_and_of_its_policy_are_merged():
    """Cameras are united, tasks intersected; actions and limits of prompts are the policy's."""
    assert PolicyNeeds.of_planner(object()) == PolicyNeeds(cameras=(), demonstration_frames="none")

    guide = Guide()
    guide.tokenizer = object()
    guide.prompt_tokens = 7
    guide.actions = "teleport"
    both = PolicyNeeds.of(Demanding()).merge(PolicyNeeds.of_planner(guide))

    assert both == PolicyNeeds.of(HierarchicalPolicy(guide, Demanding()))
    assert both.cameras == both.history_cameras == ("front", "wrist")
    assert (both.demonstration_frames, both.observe_every, both.depth) == (2, 4, True)
    assert (both.actions, both.prompt_tokens, both.tokenizer) == ("ee_pose", 64, "words.model")
    assert both.trained_tasks == both.merge(PolicyNeeds()).trained_tasks == ("BinFill",)


def test_a_tokenizer_object_is_refused_for_counting_but_not_for_playing():
    thinking = Demanding()
    thinking.tokenizer = object()

    with pytest.raises(InvalidValueError, match="tokenizer is <object"):
        PolicyNeeds.of(thinking)
    with pytest.raises(InvalidValueError, match="needs actions='ee_pose'"):
        play(SimpleNamespace(actions="waypoint"), thinking)


def test_the_environment_has_an_option_for_each_of_its_needs():
    options = PolicyNeeds.of(Demanding()).env_options
    made = asdict(EnvSettings.of(options))

    assert {**made, **made["environment"]}.items() >= options.items()
    assert set(options) < {field.name for field in fields(PolicyNeeds)}
