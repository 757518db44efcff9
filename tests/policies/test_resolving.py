"""Resolve, then act: a policy hears the explicit command of the goal that was meant."""

import itertools

import pytest
from planning_fakes import fake_vlm, model_options, stand_in

from roboirg.core.errors import InvalidValueError, UnknownNameError
from roboirg.language import expressible, instruct
from roboirg.policies.by_name.finding import make_policy, read_policy
from roboirg.policies.planners.hierarchical_policy import HierarchicalPolicy
from roboirg.policies.policy_server import open_server
from roboirg.policies.resolving.goal_namers import MeaningNamer, RuleNamer
from roboirg.policies.resolving.resolving_policy import ResolvingPolicy
from roboirg.policies.vlm.goal_schema import goal_schema
from roboirg.policies.vlm.vlm_listener import ListenerOptions, VLMNamer
from roboirg.tasks import all_tasks, goals_of
from roboirg.tasks.splits.splits import get_episode, split_episodes


class Hearer:
    """A policy that keeps what it hears."""

    cameras = ("wrist",)
    version = "v7"

    def reset(self, instruction, demonstration):
        self.heard = [instruction]
        self.frames = len(demonstration.get("wrist_rgb", ()))

    def hear(self, text, step):
        self.heard.append(text)

    def act(self, observation):
        return observation["instruction"]


class NamesNothing:
    def name_goal(self, given):
        return None


class Names:
    """Names a goal that was prescribed."""

    def __init__(self, goal):
        self.goal = goal

    def name_goal(self, given):
        return self.goal


def words_heard(namer, episode, setting):
    """What the policy behind a rewriter hears of an episode in a setting, in one prompt."""
    policy = ResolvingPolicy(namer, Hearer())
    policy.attach(stand_in(episode, setting))
    policy.reset(instruct(episode, setting).text, {})
    return policy.policy.heard


@pytest.mark.parametrize("task", all_tasks())
def test_a_namer_that_is_always_right_turns_every_setting_into_the_explicit_one(task):
    for episode in itertools.islice(split_episodes([task], ["val"]), 5):
        explicit = instruct(episode).text
        for setting in expressible(episode):
            assert words_heard(MeaningNamer(), episode, setting) == [explicit], (episode, setting)


def test_the_command_is_said_in_the_words_that_the_policy_knows():
    episode = get_episode("PickXtimes", "test", 0)
    policy = ResolvingPolicy(MeaningNamer(), Hearer(), "train")
    policy.attach(stand_in(episode, "direct"))

    policy.reset(instruct(episode, "direct").text, {})

    assert policy.policy.heard == [instruct(episode, wordings="train").text]
    assert policy.policy.heard != [instruct(episode).text]


def test_of_an_instruction_in_turns_only_the_last_utterance_is_replaced():
    episode = get_episode("PickXtimes", "test", 0)
    introduction, command = instruct(episode, "direct").turns
    policy = ResolvingPolicy(MeaningNamer(), Hearer())
    policy.attach(stand_in(episode, "direct", unheard=1))

    policy.reset(introduction, {})
    assert policy.act({"instruction": introduction}) == introduction
    assert "understood" not in policy.metadata
    policy.hear(command, 20)

    explicit = instruct(episode).text
    assert policy.policy.heard == [introduction, explicit]
    assert policy.act({"instruction": command}) == explicit


def test_a_goal_that_the_scene_does_not_have_is_said_as_well():
    """To pass such a text on, the rewriter would have to know what the scene has."""
    episode = get_episode("PickXtimes", "test", 0)
    in_scene = goals_of(episode)
    impossible = next(
        goal for goal in goal_schema("PickXtimes").goals.values() if goal not in in_scene
    )

    (heard,) = words_heard(Names(impossible), episode, "direct")

    assert str(impossible["color"]) in heard


def test_without_a_goal_the_policy_hears_what_was_said_and_that_is_counted():
    episode = get_episode("PickXtimes", "test", 0)
    policy = ResolvingPolicy(NamesNothing(), Hearer())
    policy.attach(stand_in(episode, "direct"))
    said = instruct(episode, "direct").text

    policy.reset(said, {})

    assert policy.policy.heard == [said]
    assert policy.usage() == {"passed_on": 1.0}
    assert "understood" not in policy.metadata


def test_a_rewritten_command_is_counted_and_kept_with_the_goal():
    episode = get_episode("PickXtimes", "test", 0)
    policy = ResolvingPolicy(Names(episode.goal), Hearer())
    policy.attach(stand_in(episode, "direct"))

    policy.reset(instruct(episode, "direct").text, {})

    assert policy.usage() == {"resolved": 1.0}
    assert policy.metadata["heard"] == instruct(episode).text
    assert policy.metadata["understood"] == episode.goal.as_mapping()


def test_a_rule_without_eyes_passes_on_a_text_that_names_a_thing_by_its_place():
    episode = get_episode("PickXtimes", "test", 0)

    assert words_heard(RuleNamer("surface"), episode, "spatial") == [
        instruct(episode, "spatial").text
    ]
    assert words_heard(RuleNamer("surface"), episode, "explicit") == [instruct(episode).text]


def test_a_model_behind_http_names_the_goal_from_words_and_pictures():
    episode = get_episode("PickXtimes", "test", 0)
    with fake_vlm([goal_schema("PickXtimes").answers[episode.goal]]) as server:
        namer = VLMNamer(ListenerOptions(model=model_options(server)))
        policy = ResolvingPolicy(namer, Hearer())
        policy.attach(stand_in(episode, "direct"))

        policy.reset(instruct(episode, "direct").text, {})

        assert policy.policy.heard == [instruct(episode).text]
        usage = policy.usage()
        assert (usage["calls"], usage["resolved"]) == (1, 1)
        assert instruct(episode, "direct").text in str(server.requests[0])


def test_needs_of_namer_and_policy_are_merged():
    """The namer sees the front camera and every 8th frame, the policy the wrist and all frames."""
    with fake_vlm([]) as server:
        namer = VLMNamer(ListenerOptions(model=model_options(server)))
        policy = ResolvingPolicy(namer, Hearer())

    assert policy.needs.cameras == ("front", "wrist")
    assert policy.needs.demonstration_frames == "all"


@pytest.mark.parametrize(
    ("spec", "is_privileged"),
    [
        ("resolve:surface?policy=openpi://localhost:8000", False),
        ("resolve:listener?policy=openpi://localhost:8000", True),
        ("resolve:surface?policy=last-mention", True),
        ("resolve:vlm-listener:openai?model=m&policy=openpi://localhost:8000", False),
    ],
)
def test_the_whole_is_privileged_if_the_namer_or_the_policy_is(spec, is_privileged):
    assert read_policy(spec).is_privileged == is_privileged


def test_another_namer_or_policy_is_another_makeup():
    specs = (
        "resolve:surface?policy=openpi://localhost:8000",
        "resolve:surface?policy=openpi://localhost:8000&wordings=train",
        "resolve:first-mention?policy=openpi://localhost:8000",
        "resolve:surface?policy=mme-vla://localhost:8000",
        "resolve:vlm-listener:openai?model=a&policy=openpi://localhost:8000",
        "resolve:vlm-listener:openai?model=b&policy=openpi://localhost:8000",
    )

    assert len({read_policy(spec).makeup for spec in specs}) == len(specs)


def test_its_version_names_both_and_is_not_that_of_a_planner():
    policy = ResolvingPolicy(RuleNamer("surface"), Hearer())

    assert policy.version == "built-in → v7"
    assert not isinstance(make_policy("resolve:surface?policy=surface", 0), HierarchicalPolicy)


@pytest.mark.parametrize(
    ("spec", "why"),
    [
        ("resolve:surface", "names no policy that hears them"),
        ("resolve:?policy=surface", "There is no namer ''"),
        ("resolve:sulface?policy=surface", "Did you mean 'surface'"),
        ("resolve:oracle?policy=surface", "There is no namer 'oracle'"),
        ("resolve:surface?policy=surface&x=1", "no option of resolve:surface: 'x'"),
        ("resolve:surface?policy=oracle", "'oracle' does not listen to words"),
        ("privileged:resolve:surface?policy=surface", "is not a class of your own"),
    ],
)
def test_a_spec_that_makes_no_sense_is_refused_in_one_sentence(spec, why):
    with pytest.raises((InvalidValueError, UnknownNameError), match=why):
        read_policy(spec)


def test_a_rewriter_cannot_be_served_as_it_plays_next_to_the_world():
    with pytest.raises(InvalidValueError, match="cannot be served"):
        open_server("resolve:surface?policy=openpi://localhost:8000")
