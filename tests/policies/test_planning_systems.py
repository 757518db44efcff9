"""Names on the command line, and the systems of the paper as configurations."""

import re
import subprocess
import sys
from urllib.parse import urlencode

import pytest
from planning_fakes import fake_vlm
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


def load_system(name, overrides=None, seed=0):
    return make_policy(
        f"system:{name}?{urlencode(overrides)}" if overrides else f"system:{name}", seed
    )


def test_all_systems_of_the_paper_are_known_by_name():
    assert all_systems() == SYSTEMS_OF_THE_PAPER


@pytest.mark.parametrize("name", SYSTEMS_OF_THE_PAPER)
def test_each_system_of_the_paper_can_be_made_without_a_server(name):
    policy = load_system(name)
    assert isinstance(policy, Policy)
    assert isinstance(policy, PrivilegedPolicy) == (name == "GroundSG-oracle")
    assert isinstance(policy, HierarchicalPolicy) == (name in PLANNER_OF)
    if name in PLANNER_OF:
        assert policy.metadata["planner"]["kind"] == PLANNER_OF[name]
        assert policy.grounded == (name == "GroundSG-oracle")
        assert policy.policy.options.subgoals == "grounded"

    low = policy.policy if name in PLANNER_OF else policy
    assert low.options.history == (name in {"TTT-Expert", "FrameS-Modul"})
    assert low.options.execute == 16

    policy.close()


def test_options_in_a_system_s_name_override_its_configuration():
    spec = (
        "system:GroundSG-QwenVL?server=gpu:9001&vlm=http://other:8000/v1&model=mine"
        "&video_frames=2&timeout_s=7.5&policy.execute=8"
    )
    policy = make_policy(spec, 3)
    assert policy.policy.options.execute == 8
    assert "gpu:9001" in find_system("GroundSG-QwenVL", {"server": "gpu:9001"}).policy
    assert policy.policy.options.version == "symbolic-grounded-subgoal-79999"

    options = policy.planner.options
    assert (options.video_frames, options.model.timeout_s, options.model.model) == (2, 7.5, "mine")
    assert options.model.base_url == "http://other:8000/v1"
    assert policy.metadata["system"] == "GroundSG-QwenVL"


@pytest.mark.parametrize("spec", [*(f"system:{name}" for name in SYSTEMS_OF_THE_PAPER), LISTENER])
def test_needs_and_version_of_a_system_are_known_without_making_it(spec):
    known = read_policy(spec)
    policy = make_policy(spec, 5)

    assert known.needs == PolicyNeeds.of(policy)
    assert known.is_privileged == hasattr(policy, "attach")
    assert known.version == policy.version != "unknown"


@pytest.mark.parametrize(
    ("spec", "error", "words"),
    [
        ("system:GroundSG-Qwen", UnknownNameError, "Did you mean 'GroundSG-QwenVL'"),
        ("system:", UnknownNameError, "no system ''; known: FrameS"),
        ("system:none.toml", InvalidValueError, "cannot be read"),
        ("system:pi0.5?vlm=http://x", InvalidValueError, "has no planner"),
        ("system:pi0.5?sever=x:1", UnknownNameError, "Did you mean 'server'"),
        ("system:MemER?mots=2", UnknownNameError, "Did you mean 'most'"),
        ("system:MemER?most=0", InvalidValueError, "most is '0'; it must be at least 1"),
        (
            "openpi://localhost:1?connect=1e10",
            InvalidValueError,
            "'1e10'; it must be at most 2147483",
        ),
        (
            "vlm-listener:openai?model=x&patience_s=1e30",
            InvalidValueError,
            "1e30.; it must be at most 2147483",
        ),
        ("system:MemER?kind=x", UnknownNameError, "planner 'x'; known: oracle"),
        ("system:MemER?policy.exekute=3", UnknownNameError, "Did you mean 'execute'"),
        ("system:MemER?server", InvalidValueError, r"\?name=value"),
        ("system:MemER?vlm=a&vlm=b", InvalidValueError, "'vlm' twice"),
        (
            "vlm-listener:opnai?model=x",
            InvalidValueError,
            "provider is 'opnai'; it must be 'openai' or",
        ),
        ("vlm-listener:openai", InvalidValueError, "option model is missing"),
        (
            "vlm-listener:openai?model=x&frame=3",
            UnknownNameError,
            "option of policy vlm-listener:openai named 'frame'.*mean 'frames'",
        ),
        ("vlm-listener:openai?model=x&prompts=none.toml", InvalidValueError, "cannot be read"),
        (
            "vlm-listener:openai?model=x&base_url=http://h/%3Fkey=1",
            InvalidValueError,
            "api_key_env",
        ),
        ("vlm-listener:openai?model=x&base_url=localhost:80", InvalidValueError, "http://"),
        ("sistem", UnknownNameError, "system:NAME"),
        (
            "planner:stateless?model=x&recent=3",
            InvalidValueError,
            "no option of the planner of system planner:stateless named 'recent'",
        ),
        ("planner:qwen?model=x&asked=often", InvalidValueError, r"each-chunk\|when-done\|every"),
        (
            "planner:qwen?model=x&asked=when-done&hands=mme-vla://localhost:1",
            InvalidValueError,
            "does not report",
        ),
    ],
)
def test_a_wrong_system_or_planner_name_is_refused_with_what_would_be_right(spec, error, words):
    with pytest.raises(error, match=words):
        find_policy(spec)


def test_a_user_s_system_is_a_toml_file(tmp_path):
    """Needed are a name and a policy that can follow subgoals, if there is a planner."""
    file = tmp_path / "mine.toml"
    file.write_text('name = "mine"\npolicy = "random"\n[planner]\nkind = "oracle"\n')
    with pytest.raises(InvalidValueError, match="RandomPolicy has no method follow"):
        load_system(str(file))
    with pytest.raises(InvalidValueError, match="not a URL"):
        load_system(str(file), {"server": "x:1"})

    file.write_text('name = "mine"\npolicy = "random"\n')
    assert load_system(str(file), seed=4).seed == 4

    file.write_text("name = ")
    with pytest.raises(InvalidValueError, match="cannot be read as TOML"):
        load_system(str(file))


def test_systems_can_be_made_without_network_video_or_simulation_libraries():
    """Only the first question to a model needs them; the error names the extra to install."""
    program = (
        "import sys\n"
        "class Refuse:\n"
        "    def find_spec(self, name, path=None, target=None):\n"
        "        if name.split('.')[0] in ('httpx', 'av', 'sapien'):\n"
        "            raise ImportError(name)\n"
        "sys.meta_path.insert(0, Refuse())\n"
        "from roboirg.policies import make_policy\n"
        "from roboirg.policies.planners.systems import all_systems\n"
        f"specs = [{LISTENER!r}, 'vlm-listener:google?model=x']\n"
        "specs += [f'system:{name}' for name in all_systems()]\n"
        "made = [make_policy(spec, 1) for spec in specs]\n"
        "from types import SimpleNamespace\n"
        "from roboirg.core.errors import MissingDependencyError\n"
        "from roboirg.policies.vlm.models import make_model, ModelOptions\n"
        "for provider in ('openai', 'google'):\n"
        "    try:\n"
        "        make_model(ModelOptions(provider=provider, model='m', base_url='http://x'))\n"
        "    except MissingDependencyError as error:\n"
        "        print(error)\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", program], check=False, capture_output=True, text=True
    )

    assert done.returncode == 0, done.stderr
    assert done.stdout.count("[vlm]'") == 2


class ServerWithoutMemory(MmeVlaServer):
    """The baseline and the symbolic models do not look at what was buffered."""

    def infer(self, message):
        self.frames = 1
        self.newest = message["observation/image"]
        return super().infer(message)


@pytest.mark.sim
@pytest.mark.parametrize(
    ("name", "answer", "calls", "subgoal"),
    [
        ("TTT-Expert", "", 0, "None"),
        (
            "GroundSG-Gemini",
            '{"description": "x", "subgoal_sequence": [], "subgoal": "put it down"}',
            1,
            "put it down",
        ),
        ("GroundSG-oracle", "", 0, r"pick up the \w+ cube at <\d+, \d+> .*"),
        (
            "MemER",
            '{"current_subtask": "put it down", "keyframe_positions": [1]}',
            3,
            "put it down",
        ),
    ],
)
def test_every_system_plays_a_whole_episode(name, answer, calls, subgoal):
    """Against a policy server and a model's server on real sockets, each by its own protocol."""
    remembers = name == "TTT-Expert"
    server = MmeVlaServer() if remembers else ServerWithoutMemory()
    with server, fake_vlm([answer]) as vlm:
        overrides = {"server": server.place, "policy.timeout": "300"}
        if answer:
            overrides["vlm"] = vlm.url
        policy = load_system(name, overrides)
        needs = PolicyNeeds.of(policy).env_options
        env = roboirg.make("PickXtimes", setting="direct", max_steps=40, **needs)

        info = play(env, policy)
        policy.close()

    assert info["status"] == "timeout"
    messages = [unpack(data) for data in server.messages]
    prompts = [message for message in messages if "prompt" in message]
    assert len(prompts) == 3  # 40 steps in chunks of 16
    for message in prompts:
        assert re.fullmatch(subgoal, str(message.get("grounded_subgoal")))
    assert any("add_buffer" in message for message in messages) == remembers
    assert len(vlm.requests) == calls
