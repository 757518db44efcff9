"""Instructions in turns: when each utterance is heard, and who can use it."""

import pytest
from page_text import call
from plan_files import plan_file

import roboirg
from roboirg import language
from roboirg.core.delivery import HeardUtterance, SpokenInstruction, utterance_steps
from roboirg.core.errors import UnknownNameError
from roboirg.core.instruction_options import InstructionOptions
from roboirg.language.settings import all_settings
from roboirg.policies import make_policy, play
from roboirg.records.store import read_records
from roboirg.tasks import all_tasks
from roboirg.tasks.splits.splits import get_episode


def test_an_instruction_delivered_as_a_prompt_is_heard_whole_at_step_0():
    spoken = SpokenInstruction(("It is red.", "Take it."), "prompt")

    assert spoken.heard == [("It is red.", 0), ("Take it.", 0)]
    assert (spoken.prompt, spoken.unheard) == ("It is red. Take it.", 0)


def test_a_prompt_stays_the_same_for_the_whole_episode():
    """Delivered as a prompt, both utterances are heard at step 0; at step 100 there is nothing
    new."""
    spoken = SpokenInstruction(("It is red.", "Take it."), "prompt")

    spoken.hear(100)

    assert spoken.heard == [("It is red.", 0), ("Take it.", 0)]
    assert spoken.said_at(100) == "It is red. Take it."


@pytest.mark.parametrize(
    ("count", "steps"),
    [
        (1, (0,)),
        (2, (0, 20)),
        (3, (0, 20, 40)),
        (5, (0, 10, 20, 30, 40)),
        (9, (0, 5, 10, 15, 20, 25, 30, 35, 40)),
    ],
)
def test_utterances_in_turns_are_spaced_evenly_from_step_0_until_the_latest_step(count, steps):
    """They are 20 steps apart, one second, but no later than step 40."""
    assert tuple(utterance_steps(count, "turns")) == steps


def test_more_utterances_than_steps_are_said_in_order_until_the_latest_step():
    steps = list(utterance_steps(100, "turns"))

    assert steps == sorted(steps)
    assert (steps[0], steps[-1], len(steps)) == (0, 40, 100)


def test_an_utterance_is_heard_at_the_first_observation_after_it_was_said():
    """Each letter is one. Observed are steps 9, 10, 12, ...: what is new, and how many are left."""
    spoken = SpokenInstruction("abcde", "turns")  # said at 0, 10, 20, 30 and 40
    heard = []

    for step in (9, 10, 12, 35, 36, 90):
        spoken.hear(step)
        heard.append((spoken.prompt, spoken.unheard))

    assert heard == [("a", 4), ("b", 3), ("b", 3), ("c d", 1), ("c d", 1), ("e", 0)]
    assert spoken.heard[-2:] == [HeardUtterance("d", 35), HeardUtterance("e", 90)]
    assert [spoken.said_at(step) for step in (0, 9, 20, 29, 39, 40, 90)] == list("aaccdee")


def test_settings_declare_that_they_can_come_in_turns_if_they_have_several_utterances():
    """They do so by naming *delivery* among the options that they read."""
    declared = {name for name, setting in all_settings().items() if "delivery" in setting.reads}

    several = set()
    for name in all_tasks():
        episode = get_episode(name, "test", 3)
        for setting in language.expressible(episode):
            if len(language.instruct(episode, setting).utterances) > 1:
                several.add(setting)

    assert several == declared


def test_the_words_are_the_same_in_either_delivery():
    """In turns, utterances are said one after the other; as a prompt, all at once."""
    episode = get_episode("PickXtimes", "test", 1)

    prompt = language.instruct_with(episode, InstructionOptions("contextual", delivery="prompt"))
    turns = language.instruct_with(episode, InstructionOptions("contextual", delivery="turns"))

    assert prompt == turns


def test_an_unknown_delivery_is_refused_with_the_nearest_name():
    episode = get_episode("PickXtimes", "test", 1)

    with pytest.raises(UnknownNameError, match=r"no delivery 'turn'.*Did you mean 'turns'"):
        language.instruct_with(episode, InstructionOptions(delivery="turn"))


class NotesInstructions:
    """Holds still in chunks of 15 and writes down what it is told."""

    cameras = ()
    observe_every = 5

    def __init__(self):
        self.told = []
        self.prompts = []
        self.history = []

    def reset(self, instruction, demonstration):
        self.told.append((instruction, 0))

    def hear(self, text, step):
        self.told.append((text, step))

    def act(self, observation):
        self.prompts.append(observation["instruction"])
        self.history += [entry["instruction"] for entry in observation["history"]]
        return [[*observation["joint_positions"], 1.0]] * 15


@pytest.fixture(scope="module")
def played_in_turns():
    """A policy after an episode of 70 steps, and its environment.

    Five utterances are said at steps 0, 10, 20, 30 and 40, and observed every 15 steps.
    """
    options = {"setting": "contextual", "delivery": "turns", "max_steps": 70}
    env = roboirg.make("PickXtimes", cameras=(), observe_every=5, **options)
    policy = NotesInstructions()
    play(env, policy)
    return policy, env


@pytest.mark.sim
def test_a_policy_in_an_episode_with_turns_hears_each_utterance_once_in_order(played_in_turns):
    policy, env = played_in_turns
    first, second, third, fourth, fifth = env.instruction.turns

    assert policy.told == [(first, 0), (second, 15), (third, 30), (fourth, 30), (fifth, 45)]


@pytest.mark.sim
def test_the_instruction_of_an_observation_is_what_is_new_since_the_last_one(played_in_turns):
    """At steps 0, 15, 30, 45 and 60."""
    policy, env = played_in_turns
    first, second, third, fourth, fifth = env.instruction.turns

    assert policy.prompts == [first, second, f"{third} {fourth}", fifth, fifth]


@pytest.mark.sim
def test_the_history_has_what_was_said_last_at_each_of_its_steps(played_in_turns):
    """Utterances 0 to 4 are said at steps 0, 10, 20, 30 and 40. The history has an observation of
    the steps 5, 10, ..., 60, each with the last utterance until then."""
    policy, env = played_in_turns

    said = [env.instruction.turns.index(words) for words in policy.history]

    assert said == [0, 1, 1, 2, 2, 3, 3, 4, 4, 4, 4, 4]


@pytest.mark.sim
def test_at_the_reset_of_an_episode_with_turns_the_first_utterance_is_heard():
    """Of the instruction's utterances only the first is said before the first step; it is in the
    observation, and in `info` with its step."""
    env = roboirg.make("PickXtimes", setting="contextual", cameras=(), delivery="turns")

    observation, info = env.reset()

    first = env.instruction.turns[0]
    assert observation in env.observation_space
    assert observation["instruction"] == first
    assert info["heard"] == [{"text": first, "step": 0}]


@pytest.mark.sim
def test_an_utterance_that_would_come_after_the_end_of_the_episode_is_not_heard():
    """The episode ends after 20 steps, in the middle of a chunk of 30; one utterance is left."""
    env = roboirg.make("PickXtimes", setting="direct", cameras=(), max_steps=20, delivery="turns")
    observation, info = env.reset()
    action = [*observation["joint_positions"], 1.0]

    observation, _, _, truncated, info = env.step_chunk([action] * 30)

    assert truncated
    assert (info["heard"], env.unheard) == ([], 1)
    assert observation["instruction"] == env.instruction.turns[0]


@pytest.mark.sim
def test_all_turns_of_a_stopcube_episode_come_before_its_earliest_press():
    """Else it could not be won in turns: here the button has to be pressed at step 60."""
    told = {"setting": "contextual", "delivery": "turns"}
    env = roboirg.make("StopCube", episode=3, cameras=(), **told)

    assert play(env, make_policy("listener", 0))["status"] == "success"


@pytest.fixture(scope="module")
def run_in_turns(tmp_path_factory):
    """The folder of a run in turns: an episode in *explicit* and the same one in *direct*."""
    folder = tmp_path_factory.mktemp("run")
    plan = plan_file(
        tasks="VideoUnmask", settings="explicit,direct", delivery="turns", episodes=1, video="all"
    )
    call("run", "--plan", plan, "--policy", "listener", "--workers", "0", "--out", folder)
    return folder


@pytest.fixture
def records_of_run_in_turns(run_in_turns):
    """The record of the listener's episode in each setting."""
    return {record.options.setting: record for record in read_records(run_in_turns)}


@pytest.mark.sim
def test_a_run_in_turns_records_the_step_of_each_utterance(records_of_run_in_turns):
    """In the setting *direct* the instruction has two utterances, which are 20 steps apart."""
    direct = records_of_run_in_turns["direct"]

    assert direct.options.delivery == "turns"
    assert [utterance.step for utterance in direct.instruction] == [0, 20]


@pytest.mark.sim
def test_a_single_utterance_in_a_run_in_turns_is_recorded_as_a_prompt(records_of_run_in_turns):
    """An instruction of the setting *explicit* is one command, which is said at once, whatever the
    plan asks for."""
    explicit = records_of_run_in_turns["explicit"]

    assert explicit.options.delivery == "prompt"
    assert [utterance.step for utterance in explicit.instruction] == [0]


@pytest.mark.sim
def test_a_listener_in_a_run_in_turns_waits_for_the_last_utterance(records_of_run_in_turns):
    """The listener solves the episode from its explicit command, said at step 0, and in the setting
    *direct*, where the second utterance comes at step 20. It acts then, and needs as many steps."""
    explicit = records_of_run_in_turns["explicit"]
    direct = records_of_run_in_turns["direct"]

    assert (explicit.outcome, direct.outcome) == ("success", "success")
    assert direct.steps == explicit.steps + 20


@pytest.mark.sim
def test_a_run_in_turns_has_a_video_of_each_episode(run_in_turns):
    """The plan asks for the videos of both episodes; one has thousands of bytes."""
    sizes = [path.stat().st_size for path in run_in_turns.glob("videos/*.mp4")]

    assert len(sizes) == 2
    assert min(sizes) > 1000
