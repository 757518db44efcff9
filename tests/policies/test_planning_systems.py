"""Names on the command line, and the systems of the paper as configurations."""

import re
from urllib.parse import urlencode

import pytest
from planning_fakes import fake_vlm
from python_process import print_of_python
from wire_servers import MmeVlaServer, unpack

import roboirg
from roboirg.core.errors import InvalidValueError, UnknownNameError
from roboirg.core.policy_needs import PolicyNeeds
from roboirg.policies import Policy, PrivilegedPolicy, find_policy, make_policy, play
from roboirg.policies.by_name.finding import read_policy
from roboirg.policies.planners.hierarchical_policy import HierarchicalPolicy
from roboirg.policies.planners.systems import all_systems, find_system

SYSTEMS_OF_THE_PAPER = (
    "FrameS-Modul", "GroundSG-Gemini", "GroundSG-QwenVL", "GroundSG-oracle", "MemER",
    "TTT-Expert", "pi0.5",
)  # fmt: skip
PLANNER_OF = {
    "GroundSG-Gemini": "gemini",
    "GroundSG-QwenVL": "qwen",
    "GroundSG-oracle": "oracle",
    "MemER": "memer",
}
LISTENER = "vlm-listener:openai?base_url=http://localhost:8000/v1&model=qwen"


def load_system(name, overrides=None):
    """Return a policy of the system of a name, with options that override its configuration."""
    options = f"?{urlencode(overrides)}" if overrides else ""
    return make_policy(f"system:{name}{options}", 0)


def test_all_systems_of_the_paper_are_known_by_name():
    assert all_systems() == SYSTEMS_OF_THE_PAPER


@pytest.mark.parametrize("name", SYSTEMS_OF_THE_PAPER)
def test_each_system_of_the_paper_can_be_made_without_a_server(name):
    policy = load_system(name)

    assert isinstance(policy, Policy)
    assert isinstance(policy, PrivilegedPolicy) == (name == "GroundSG-oracle")
    policy.close()


@pytest.mark.parametrize(("name", "kind"), PLANNER_OF.items())
def test_a_system_with_a_planner_asks_it_for_subgoals_with_points(name, kind):
    """Its policy plays 16 steps of what a subgoal asks for; only the oracle sees points itself."""
    policy = load_system(name)

    assert isinstance(policy, HierarchicalPolicy)
    assert policy.metadata["planner"]["kind"] == kind
    assert policy.grounded == (kind == "oracle")
    assert policy.policy.options.subgoals == "grounded"
    assert policy.policy.options.execute == 16
    policy.close()


@pytest.mark.parametrize(
    ("name", "remembers"), [("TTT-Expert", True), ("FrameS-Modul", True), ("pi0.5", False)]
)
def test_a_system_without_a_planner_sends_its_history_if_it_has_a_memory(name, remembers):
    """All three are policies behind a server, which is asked after each 16 steps (`execute`);
    pi0.5 has no memory.
    """
    policy = load_system(name)

    assert not isinstance(policy, HierarchicalPolicy)
    assert policy.options.history == remembers
    assert policy.options.execute == 16
    policy.close()


def test_options_in_a_system_s_name_override_its_configuration():
    """Options of the planner and of its model stand alone (`vlm` is the address of the model's
    server), those of the policy behind it have the prefix `policy.`.
    """
    policy = make_policy(
        "system:GroundSG-QwenVL?server=gpu:9001&vlm=http://other:8000/v1&model=mine"
        "&video_frames=2&timeout_s=7.5&policy.execute=8",
        3,
    )

    planner = policy.planner.options
    assert planner.video_frames == 2
    assert planner.model.timeout_s == 7.5
    assert planner.model.model == "mine"
    assert planner.model.base_url == "http://other:8000/v1"
    assert policy.policy.options.execute == 8


def test_an_option_of_a_system_changes_the_address_of_its_policy_and_leaves_its_version():
    system = find_system("GroundSG-QwenVL", {"server": "gpu:9001"})

    policy = make_policy(system.policy, 0)

    assert "gpu:9001" in system.policy
    assert policy.options.version == "symbolic-grounded-subgoal-79999"


@pytest.mark.parametrize("spec", [*(f"system:{name}" for name in SYSTEMS_OF_THE_PAPER), LISTENER])
def test_needs_and_version_of_a_system_are_known_without_making_it(spec):
    """`read_policy` reads the name alone. A policy that is privileged has a method attach(env)."""
    known = read_policy(spec)
    policy = make_policy(spec, 5)

    assert known.needs == PolicyNeeds.of(policy)
    assert known.is_privileged == hasattr(policy, "attach")
    assert known.version == policy.version != "unknown"


@pytest.mark.parametrize(
    ("spec", "error", "words"),
    [
        ("system:GroundSG-Qwen", UnknownNameError, "Did you mean 'GroundSG-QwenVL'"),
        ("system:none.toml", InvalidValueError, "cannot be read"),
        ("system:pi0.5?vlm=http://x", InvalidValueError, "has no planner"),
        ("system:pi0.5?sever=x:1", UnknownNameError, "Did you mean 'server'"),
        ("system:MemER?mots=2", UnknownNameError, "Did you mean 'most'"),
        ("system:MemER?most=0", InvalidValueError, "most is '0'; it must be at least 1"),
        ("openpi://localhost:1?connect=1e10", InvalidValueError, "it must be at most 2147483"),
        ("system:MemER?kind=x", UnknownNameError, "planner 'x'; known: oracle"),
        ("system:MemER?policy.exekute=3", UnknownNameError, "Did you mean 'execute'"),
        ("system:MemER?server", InvalidValueError, r"\?name=value"),
        ("system:MemER?vlm=a&vlm=b", InvalidValueError, "'vlm' twice"),
        ("vlm-listener:opnai?model=x", InvalidValueError, "'opnai'; it must be 'openai' or"),
        ("vlm-listener:openai", InvalidValueError, "option model is missing"),
        ("vlm-listener:openai?model=x&frame=3", UnknownNameError, "named 'frame'.*mean 'frames'"),
        ("vlm-listener:openai?model=x&base_url=http://h/%3Fk=1", InvalidValueError, "api_key_env"),
        ("vlm-listener:openai?model=x&base_url=localhost:80", InvalidValueError, "http://"),
        ("sistem", UnknownNameError, "system:NAME"),
        ("planner:stateless?model=x&recent=3", InvalidValueError, "no option of .* named 'recent'"),
        ("planner:qwen?model=x&asked=often", InvalidValueError, r"each-chunk\|when-done\|every"),
        ("planner:qwen?model=x&asked=when-done&hands=mme-vla://localhost:1", InvalidValueError,
         "does not report"),
    ],
)  # fmt: skip
def test_a_wrong_system_or_planner_name_is_refused_with_what_would_be_right(spec, error, words):
    """Each name is wrong in one respect: a word, an option, its value, or one that is missing."""
    with pytest.raises(error, match=words):
        find_policy(spec)


def system_file(folder, text):
    """Write the file of a system, and return the name of its policy."""
    path = folder / "mine.toml"
    path.write_text(text)
    return f"system:{path}"


def test_a_user_s_system_is_a_toml_file(tmp_path):
    spec = system_file(tmp_path, 'name = "mine"\npolicy = "random"\n')

    assert make_policy(spec, 4).seed == 4


@pytest.mark.parametrize(
    ("text", "options", "reason"),
    [
        (
            'name = "mine"\npolicy = "random"\n[planner]\nkind = "oracle"\n',
            "",
            "RandomPolicy has no method follow",
        ),
        ('name = "mine"\npolicy = "random"\n', "?server=x:1", "not a URL"),
        ("name = ", "", "cannot be read as TOML"),
    ],
    ids=["a policy that follows no subgoals", "a server for a policy without one", "no TOML"],
)
def test_a_user_s_system_that_cannot_be_made_is_refused(tmp_path, text, options, reason):
    """The file of the system has this text; `options` follow its path in the name of the policy."""
    with pytest.raises(InvalidValueError, match=reason):
        make_policy(system_file(tmp_path, text) + options, 0)


PROGRAM_WITHOUT_LIBRARIES = """
import sys
for name in ("httpx", "av", "sapien"):
    sys.modules[name] = None  # an import raises ImportError

from roboirg.core.errors import MissingDependencyError
from roboirg.policies import make_policy
from roboirg.policies.planners.systems import all_systems
from roboirg.policies.vlm.models import ModelOptions, make_model

make_policy("vlm-listener:openai?base_url=http://localhost:8000/v1&model=qwen", 1)
make_policy("vlm-listener:google?model=x", 1)
for name in all_systems():
    make_policy(f"system:{name}", 1)
for provider in ("openai", "google"):
    try:
        make_model(ModelOptions(provider=provider, model="m", base_url="http://x"))
    except MissingDependencyError as error:
        print(error)
"""


def test_systems_can_be_made_without_network_video_or_simulation_libraries():
    """Only the first question to a model needs them; the error names the extra to install."""
    printed = print_of_python("-c", PROGRAM_WITHOUT_LIBRARIES)

    assert printed.count("[vlm]'") == 2


class ServerWithoutMemory(MmeVlaServer):
    """The baseline and the symbolic models do not look at what was buffered."""

    def infer(self, message):
        self.frames = 1
        self.newest = message["observation/image"]
        return super().infer(message)


def play_two_seconds(name, server, model):
    """Play 40 control steps with a system of the paper; its policy asks at steps 0, 16 and 32.

    Args:
        name: of the system.
        server: of its policy, which writes down its messages.
        model: the server of its planner's model; None for a system without one.
    """
    addresses = {"server": server.place, "policy.timeout": "300"}
    if model is not None:
        addresses["vlm"] = model.url
    policy = load_system(name, addresses)
    needs = PolicyNeeds.of(policy).env_options
    env = roboirg.make("PickXtimes", setting="direct", max_steps=40, **needs)
    info = play(env, policy)
    policy.close()
    assert info["status"] == "timeout"


def subgoals_sent_to(server):
    """Return the subgoal in each request for actions that a policy server got; None for none."""
    messages = map(unpack, server.messages)
    return [message.get("grounded_subgoal") for message in messages if "prompt" in message]


@pytest.mark.sim
def test_a_system_without_a_planner_sends_no_subgoals():
    """TTT-Expert is a policy with a memory, which asks its server for actions at steps 0, 16 and 32
    of 40.
    """
    with MmeVlaServer() as server:
        play_two_seconds("TTT-Expert", server, model=None)

    assert subgoals_sent_to(server) == [None, None, None]


@pytest.mark.sim
def test_the_oracle_system_sends_subgoals_with_points_of_the_picture():
    """Its planner reads the simulator and asks no model: *pick up the red cube at <120, 80>* ..."""
    with ServerWithoutMemory() as server:
        play_two_seconds("GroundSG-oracle", server, model=None)

    subgoals = subgoals_sent_to(server)
    assert len(subgoals) == 3
    for subgoal in subgoals:
        assert re.fullmatch(r"pick up the \w+ cube at <\d+, \d+> .*", subgoal)


@pytest.mark.sim
@pytest.mark.parametrize(
    ("name", "reply", "questions"),
    [
        (
            "GroundSG-Gemini",
            '{"description": "x", "subgoal_sequence": [], "subgoal": "put it down"}',
            1,
        ),
        ("MemER", '{"current_subtask": "put it down", "keyframe_positions": [1]}', 3),
    ],
)
def test_a_system_with_a_model_sends_the_subgoal_that_the_model_names(name, reply, questions):
    """The model always replies *put it down*, in the JSON that each planner asks for.

    In 40 steps the policy asks its server for actions three times, each time with that subgoal. The
    planner of MemER asks its model before each of them; that of GroundSG-Gemini once, as it does
    not ask again before step 75.
    """
    with ServerWithoutMemory() as server, fake_vlm([reply]) as model:
        play_two_seconds(name, server, model)

    assert subgoals_sent_to(server) == ["put it down", "put it down", "put it down"]
    assert len(model.requests) == questions
