"""Resolve, then act: a policy hears the explicit command of the goal that was meant."""

import pytest
from planning_fakes import fake_vlm, model_options, stand_in

from roboirg.core.episode import Goal
from roboirg.core.errors import InvalidValueError, UnknownNameError
from roboirg.language import expressible, instruct
from roboirg.policies.by_name.finding import read_policy
from roboirg.policies.policy_server import open_server
from roboirg.policies.resolving.goal_namers import MeaningNamer, RuleNamer
from roboirg.policies.resolving.resolving_policy import ResolvingPolicy
from roboirg.policies.vlm.vlm_listener import ListenerOptions, VLMNamer
from roboirg.tasks import all_tasks
from roboirg.tasks.splits.splits import get_episode

# The instruction of episode 0 of the test split of PickXtimes, whose goal is {green, 3}.
INTRODUCTION = "I want to see how you handle the green cube."
COMMAND = "Grab it and place it on the target three times, then press the button."
DIRECT = f"{INTRODUCTION} {COMMAND}"
EXPLICIT = "Grab the green cube and place it on the target three times, then press the button."
SPATIAL = (
    "Let's start with the cube on the left. "
    "Please grab it and place it on the target three times, then press the button."
)


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


def resolving(namer, setting="direct", wordings=None, **more):
    """A policy that hears what a namer makes of the instruction, in episode 0 of PickXtimes."""
    policy = ResolvingPolicy(namer, Hearer(), wordings)
    policy.attach(stand_in(get_episode("PickXtimes", "test", 0), setting, **more))
    return policy


@pytest.mark.parametrize("number", range(5))
@pytest.mark.parametrize("task", all_tasks())
def test_with_a_namer_that_is_always_right_a_policy_hears_the_explicit_command(task, number):
    """A namer says which goal an instruction means, and the policy behind it hears the explicit
    command of that goal. `MeaningNamer` is always right, as it reads the meaning of the words
    from the generator.

    So whatever the setting, which is how the instruction implies its goal, the policy (which keeps
    what it hears) hears the explicit instruction. Tried are all settings that can express the goal
    of each of five episodes of the split "val"; `stand_in` has what the namer reads of an
    environment.
    """
    episode = get_episode(task, "val", number)
    settings = expressible(episode)

    assert "explicit" in settings
    for setting in settings:
        policy = ResolvingPolicy(MeaningNamer(), Hearer())
        policy.attach(stand_in(episode, setting))
        policy.reset(instruct(episode, setting).text, {})

        assert policy.policy.heard == [instruct(episode, "explicit").text], setting


def test_the_command_is_said_in_the_words_that_the_policy_knows():
    """Said is, in words for tests, *I want to see how you handle the green cube. Grab it and …*.

    The policy was trained with the words of the pool "train": it hears the explicit command in
    these.
    """
    policy = resolving(MeaningNamer(), wordings="train")

    policy.reset(DIRECT, {})

    assert policy.policy.heard == [
        "Move the green cube onto the target three times, then press the button."
    ]


def test_of_an_instruction_in_turns_only_the_last_utterance_is_replaced():
    """The first sentence is said at the start, and the command at step 20.

    What *it* means is known only then, so the policy hears the first sentence as it was said, and
    then the command with the value in place of *it*.
    """
    policy = resolving(MeaningNamer(), unheard=1)

    policy.reset("I want to see how you handle the green cube.", {})
    policy.hear("Grab it and place it on the target three times, then press the button.", 20)

    assert policy.policy.heard == [
        "I want to see how you handle the green cube.",
        "Grab the green cube and place it on the target three times, then press the button.",
    ]


def test_observations_show_the_instruction_as_the_policy_has_heard_it():
    """The instruction comes in two sentences, the second at step 20; the namer, which is always
    right, then replaces *it* by *the green cube*.

    An observation has the last sentence that was said, but the policy (which returns what its
    observation has) is shown what it has heard instead.
    """
    policy = resolving(MeaningNamer(), unheard=1)
    said = "I want to see how you handle the green cube."
    said_later = "Grab it and place it on the target three times, then press the button."

    policy.reset(said, {})
    shown = policy.act({"instruction": said})
    policy.hear(said_later, 20)
    shown_later = policy.act({"instruction": said_later})

    assert shown == "I want to see how you handle the green cube."
    assert shown_later == (
        "Grab the green cube and place it on the target three times, then press the button."
    )


def test_before_the_last_utterance_nothing_is_understood():
    """Of two utterances only the first, *I want to see how you handle the green cube*, was said."""
    policy = resolving(MeaningNamer(), unheard=1)

    policy.reset(INTRODUCTION, {})

    assert "understood" not in policy.metadata


def test_a_goal_that_the_scene_does_not_have_is_put_into_words_as_well():
    """The scene has a green cube only, and the namer of this test names the red one, once.

    To keep that from the policy, one would have to look at the scene, which no robot can do so.
    """
    namer = Names(Goal.of(color="red", repeats=1))
    policy = resolving(namer)

    policy.reset("I want to see how you handle the green cube. Grab it and place it there.", {})

    (heard,) = policy.policy.heard
    assert "red cube" in heard


def test_without_a_goal_the_policy_hears_what_was_said_and_that_is_counted():
    """The namer of this test finds no goal in any text. DIRECT is what was said, *I want to see
    how you handle the green cube. Grab it …*; it is passed on.
    """
    policy = resolving(NamesNothing())

    policy.reset(DIRECT, {})

    assert policy.policy.heard == [DIRECT]
    assert policy.usage() == {"passed_on": 1.0}
    assert "understood" not in policy.metadata


def test_a_rewritten_command_is_counted_and_kept_with_the_goal():
    """The namer names the goal of the episode: the green cube, three times.

    Said was *I want to see how you handle the green cube. Grab it …*; EXPLICIT is *Grab the green
    cube and place it on the target three times, then press the button.*
    """
    policy = resolving(Names(get_episode("PickXtimes", "test", 0).goal))

    policy.reset(DIRECT, {})

    assert policy.usage() == {"resolved": 1.0}
    assert policy.metadata["heard"] == EXPLICIT
    assert policy.metadata["understood"] == {"color": "green", "repeats": 3}


@pytest.mark.parametrize("text", [SPATIAL, EXPLICIT], ids=["by its place", "by its color"])
def test_a_rule_without_eyes_says_no_more_of_a_thing_than_the_text(text):
    """It passes on a text that names a thing by its place, and repeats an explicit one."""
    policy = resolving(RuleNamer("surface"))

    policy.reset(text, {})

    assert policy.policy.heard == [text]


def test_a_model_behind_http_names_the_goal_from_what_was_said():
    """The service (a stand-in) names the green cube, three times, in JSON; it is asked once.

    DIRECT is what was said, *… the green cube. Grab it …*, and stands in the request; EXPLICIT is
    the command with the value, *Grab the green cube … three times …*, which the policy hears.
    """
    with fake_vlm(['{"color": "green", "repeats": 3}']) as server:
        policy = resolving(VLMNamer(ListenerOptions(model=model_options(server))))

        policy.reset(DIRECT, {})

    assert policy.policy.heard == [EXPLICIT]
    assert policy.usage()["calls"] == 1
    assert DIRECT in str(server.requests[0])


def test_needs_of_namer_and_policy_are_merged():
    """The namer sees the front camera and every 8th frame, the policy the wrist and all frames.

    Together they need both cameras and all frames.
    """
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
    """A policy is privileged if it reads more of the simulator than a robot could see.

    The namer "listener" does so, and the policy "last-mention"; "surface" reads the text, and a
    model's service and openpi get pictures.
    """
    assert read_policy(spec).is_privileged == is_privileged


@pytest.mark.parametrize(
    ("spec", "other"),
    [
        (
            "surface?policy=openpi://localhost:1",
            "surface?policy=openpi://localhost:1&wordings=train",
        ),
        ("surface?policy=openpi://localhost:1", "first-mention?policy=openpi://localhost:1"),
        ("surface?policy=openpi://localhost:1", "surface?policy=mme-vla://localhost:1"),
        (
            "vlm-listener:openai?model=a&policy=openpi://localhost:1",
            "vlm-listener:openai?model=b&policy=openpi://localhost:1",
        ),
    ],
    ids=["wordings", "namer", "policy", "model of the namer"],
)
def test_another_part_makes_another_policy(spec, other):
    """Runs of one `makeup` are counted as those of one policy."""
    assert read_policy(f"resolve:{spec}").makeup != read_policy(f"resolve:{other}").makeup


def test_the_version_names_that_of_the_namer_and_of_the_policy():
    """The namer "surface" is built in; the policy behind it declares the version *v7*."""
    policy = ResolvingPolicy(RuleNamer("surface"), Hearer())

    assert policy.version == "built-in → v7"


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
    """Right would be *resolve:NAMER?policy=POLICY*, with a namer that finds the goal in the words
    and a policy that listens to words.
    """
    with pytest.raises((InvalidValueError, UnknownNameError), match=why):
        read_policy(spec)


def test_a_rewriter_cannot_be_served_as_it_plays_next_to_the_world():
    with pytest.raises(InvalidValueError, match="cannot be served"):
        open_server("resolve:surface?policy=openpi://localhost:8000")
