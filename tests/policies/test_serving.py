"""Policies of this process behind real sockets: inputs, outputs and errors."""

import contextlib
import platform
import signal
from http.client import HTTPConnection
from typing import ClassVar

import numpy as np
import pytest
from attackers import serving
from served_here import served
from websockets.exceptions import ConnectionClosedError
from websockets.sync.client import connect
from wire_episode import INSTRUCTION, moment, video
from wire_servers import pack, unpack

from roboirg.core.errors import InvalidValueError, PolicyReplyError, UnknownNameError
from roboirg.policies import make_policy
from roboirg.policies.policy_server import open_server
from roboirg.policies.remote.protocols import protocols_by_scheme
from roboirg.policies.remote.websocket_server import ServerOptions

HERE = f"{__name__}:Recorder"
SERVED = [scheme for scheme, protocol in protocols_by_scheme().items() if protocol.service]


class Recorder:
    """Writes down what it is given; counts its calls in its actions."""

    episodes: ClassVar[list] = []
    metadata: ClassVar[dict] = {"network": "none"}

    def __init__(self, seed=0):
        self.seed = seed
        self.calls = []
        self.subgoals = []
        self.closed = False
        self.heard = []
        self.episodes.append(self)

    def reset(self, instruction, demonstration):
        self.instruction = instruction
        self.demonstration = demonstration

    def follow(self, subgoal):
        self.subgoals.append(subgoal)

    def hear(self, text, step):
        self.heard.append((text, step))

    def act(self, observation):
        if observation["instruction"].startswith("fail"):
            raise RuntimeError("the weights melted")
        self.calls.append(observation)
        return np.full((4, 8), len(self.calls), np.float32)

    def close(self):
        self.closed = True


class Remembering(Recorder):
    observe_every = 1


class Seeing(Remembering):
    depth = True


class Posing(Recorder):
    actions = "ee_pose"


@pytest.fixture(autouse=True)
def _forget():
    Recorder.episodes.clear()


def check_same(given, kept, fields):
    for field in fields:
        assert np.array_equal(given[field], kept[field]), field


FIELDS_SENT = {
    "openpi": ("front_rgb", "wrist_rgb", "joint_positions"),
    "mme-vla": ("front_rgb", "wrist_rgb", "joint_positions"),
    "challenge": ("front_rgb", "wrist_rgb", "joint_positions", "gripper", "end_effector"),
}


def play(url, length, *moments, **more):
    """Play an episode at a server; return the chunks and the client's metadata."""
    client = make_policy(url, 0)
    client.reset(moments[0]["instruction"], video(length, **more))
    chunks = [client.act(seen).tolist() for seen in moments]
    client.close()
    return chunks, client.metadata


FIRST_MOMENT = moment(3, history=())
LATER_MOMENT = moment(5, history=(moment(4), moment(5)))


def served_episodes(protocol):
    """Play two episodes through a server, of videos of three and two moments."""
    expected = {
        "policy": HERE, "network": "none", "protocol": protocol,
        "python": platform.python_version(),
    }  # fmt: skip
    with served(HERE, protocol, seed=7) as url:
        for length in (3, 2):
            chunks, metadata = play(url, length, FIRST_MOMENT, LATER_MOMENT)
            assert chunks == [[[1] * 8] * 4, [[2] * 8] * 4]
            assert expected.items() <= metadata.items()
    _opened, *episodes = Recorder.episodes
    return episodes


@pytest.mark.parametrize("protocol", SERVED)
def test_a_served_policy_sees_what_its_client_was_shown(protocol):
    """A client plays two episodes at a server: in each, two moments are shown to the policy behind
    it.

    The policy writes down what it gets: seed 7 of the server, the instruction (MME-VLA lowers it),
    and the fields that the protocol carries, equal to what the client was given. A message has one
    number for the gripper; the policy sees it as two fingers, of which the first is compared.
    """
    first, second = served_episodes(protocol)

    for policy in (first, second):
        assert (policy.seed, policy.closed) == (7, True)
        assert policy.instruction == (INSTRUCTION.lower() if protocol == "mme-vla" else INSTRUCTION)
        for given, observation in zip((FIRST_MOMENT, LATER_MOMENT), policy.calls, strict=True):
            check_same(given, observation, FIELDS_SENT[protocol])
            assert observation["gripper"].shape == (2,)
            assert observation["gripper"][0] == given["gripper"][0]


@pytest.mark.parametrize("protocol", [name for name in SERVED if name != "openpi"])
def test_a_served_policy_sees_the_video_and_the_moments_between_two_questions(protocol):
    """A client plays two episodes, with videos of three and of two moments.

    The policy behind the server sees the videos, and at the second question the moments 4 and 5
    since the first, as its history. MME-VLA sends no pictures of the wrist in these, and openpi
    neither videos nor moments.
    """
    first, second = served_episodes(protocol)
    shown = set(FIELDS_SENT[protocol])
    if protocol == "mme-vla":
        shown.remove("wrist_rgb")

    check_same(video(3), first.demonstration, shown)
    assert len(second.demonstration["joint_positions"]) == 2
    assert first.calls[0]["history"][:-1] == ()
    for given, kept in zip(LATER_MOMENT["history"], first.calls[1]["history"], strict=True):
        check_same(given, kept, shown)


def test_a_policy_that_is_served_by_openpi_gets_no_video():
    """The client has a video of three moments, which openpi has no message for."""
    first, _ = served_episodes("openpi")
    assert len(first.demonstration["joint_positions"]) == 0


GROWING_PROMPT = [
    {**moment(0, history=()), "instruction": "this one is red."},
    {**moment(2, history=(moment(1), moment(2))), "instruction": "please note."},
    {**moment(3, history=(moment(3),)), "instruction": "please note."},
    {**moment(5, history=(moment(4), moment(5))), "instruction": "take it."},
]
"""What a client sends at four questions: its instruction changes twice, at steps 2 and 5."""


@pytest.mark.parametrize("protocol", [name for name in SERVED if name != "openpi"])
def test_a_served_policy_hears_each_new_sentence_of_a_growing_prompt(protocol):
    """In both episodes the client's prompt changes: *this one is red*, *please note*, *take it*.

    The first is the instruction; the policy hears the others with the steps at which they came, 2
    and 5. Steps of the second episode, which is checked here, are counted from its own beginning.
    """
    with served(HERE, protocol) as url:
        play(url, 3, *GROWING_PROMPT)
        play(url, 2, *GROWING_PROMPT)

    *_, policy = Recorder.episodes
    assert policy.instruction == "this one is red."
    assert policy.heard == [("please note.", 2), ("take it.", 5)]


def test_openpi_has_no_reset_so_that_a_new_prompt_is_a_new_episode():
    """The client's prompt ends with *take it*: the last policy has it as its instruction.

    It heard nothing during its episode, as each of the changes before began another one.
    """
    with served(HERE, "openpi") as url:
        play(url, 3, *GROWING_PROMPT)

    *_, policy = Recorder.episodes
    assert policy.instruction == "take it."
    assert policy.heard == []


def test_a_served_policy_sees_depth_and_calibration_if_the_client_sends_them():
    """Moment 3 is shown at the first question, and moments 4 and 5 at the second.

    The policy wants depth and declares that it observes each step. What it gets equals what the
    client was given, field by field: in the video, at the first question, and in the history of
    the second.
    """
    before, between, now = (moment(number, sensors=True) for number in (3, 4, 5))
    fields = [field for field in now if field != "instruction"]

    with served(f"{__name__}:Seeing", "challenge") as url:
        play(
            f"{url}?depth=yes&calibration=yes", 3, {**before, "history": ()},
            {**now, "history": (between, now)}, sensors=True,
        )  # fmt: skip

    _opened, policy = Recorder.episodes
    first, second = policy.calls
    check_same(video(3, sensors=True), policy.demonstration, fields)
    check_same(before, first, fields)
    check_same(between, second["history"][0], fields)
    check_same(now, second["history"][1], fields)
    assert second["front_depth"].dtype == np.int16


def test_a_request_whose_lists_differ_in_length_is_refused():
    """A request shows two moments in lists, one for each field, but depth of one of them only."""
    request = {"task_goal": ["go"], "is_first_step": True, "front_depth_list": [np.zeros(3)]}
    for name in ("front_rgb", "wrist_rgb", "joint_state", "eef_state", "gripper_state"):
        request[f"{name}_list"] = [np.zeros(3), np.zeros(3)]

    with served(HERE, "challenge") as url, opened(url) as raw:
        raw.send(pack(request))
        answer = raw.recv()

    assert "front_depth_list must be lists of the same length" in answer


@contextlib.contextmanager
def opened(url):
    """Connect to a server without a client of ours, and take its metadata."""
    _, _, place = url.partition("://")
    with connect(f"ws://{place}") as raw:
        assert unpack(raw.recv())["policy"] == HERE
        yield raw


def reply_to(raw, message):
    raw.send(pack(message))
    return unpack(raw.recv())


FRAMES = np.stack([moment(number)["front_rgb"][None] for number in range(3)])
VIDEO_OF_TWO_FRAMES_AND_THE_FIRST_MOMENT = {
    "add_buffer": True,
    "images": FRAMES,
    "state": np.zeros((3, 8), np.float32),
    "exec_start_idx": 2,
}


@pytest.mark.parametrize("kind", ["grounded", "simple"])
def test_connections_to_an_mme_vla_server_share_one_policy(kind):
    """The video comes over one connection, and the question with its subgoal over another.

    The buffer holds two frames of the video and the current one: the policy sees the video of two,
    and follows the subgoal. (The first recorded policy is the one with which the server was
    opened.)
    """
    request = {
        "observation/image": FRAMES[2, 0],
        "observation/wrist_image": FRAMES[2, 0],
        "observation/state": np.zeros(8),
        "prompt": "go",
        f"{kind}_subgoal": "pick up the cube at <1, 2>",
    }
    with served(HERE, "mme-vla") as url, opened(url) as first, opened(url) as second:
        reset = reply_to(first, {"reset": True})
        shown = reply_to(first, VIDEO_OF_TWO_FRAMES_AND_THE_FIRST_MOMENT)
        asked = reply_to(second, request)

    assert reset.keys() == {"reset_finished", "reset_time_ms"}
    assert shown.keys() == {"add_buffer_finished", "add_buffer_time_ms"}
    assert asked.keys() == {"actions", "infer_time_ms"}
    _opened, policy = Recorder.episodes
    assert np.array_equal(policy.demonstration["front_rgb"], FRAMES[:2, 0])
    assert policy.subgoals == ["pick up the cube at <1, 2>"]


def test_idle_connections_make_no_policy():
    """The only one is that with which the server was opened."""
    with served(HERE, "mme-vla") as url, opened(url), opened(url):
        assert len(Recorder.episodes) == 1


@pytest.mark.parametrize(
    ("message", "words"),
    [
        (b"\xc1", "the bytes are not a msgpack message"),
        (pack({}), "'observation/state' must be real numbers (8); got nothing"),
        (pack({"add_buffer": True, "images": np.zeros((2, 4, 4, 3), np.uint8)}), "'images' must"),
        ("hello", "Messages must be binary"),
    ],
    ids=["no msgpack", "no state", "pictures of one camera", "text"],
)
def test_a_malformed_request_is_answered_by_a_traceback_and_close_code_1011(message, words):
    """1011 is the code of WebSocket for an error of the server; before it, a text says what was
    wrong.
    """
    with served(HERE, "mme-vla") as url, opened(url) as raw:
        raw.send(message)
        answer = raw.recv()
        with pytest.raises(ConnectionClosedError) as closed:
            raw.recv()

    assert answer.startswith("Traceback")
    assert words in answer
    assert closed.value.rcvd.code == 1011


def test_after_a_malformed_request_the_next_episode_works():
    """The byte C1 is no message of msgpack. The next client gets one chunk of 4 actions of 8
    numbers.
    """
    with served(HERE, "mme-vla") as url:
        with opened(url) as raw:
            raw.send(b"\xc1")
            raw.recv()

        chunks, _ = play(url, 0, moment(0, history=()))

    assert np.shape(chunks) == (1, 4, 8)


@pytest.mark.parametrize("protocol", SERVED)
def test_an_exception_in_a_served_policy_reaches_the_client_with_its_message(protocol):
    """The policy here fails at the instruction *fail*; the next episode works."""
    now = moment(1, history=())
    with served(HERE, protocol) as url:
        with pytest.raises(PolicyReplyError, match="RuntimeError: the weights melted"):
            play(url, 1, {**now, "instruction": "fail"})

        assert play(url, 1, now)


@pytest.mark.parametrize("protocol", SERVED)
def test_a_server_reports_its_health_to_anyone(protocol):
    """Also without the key *sesame*, at the path /healthz."""
    with served(HERE, protocol, key="sesame") as url:
        health = HTTPConnection(url.split("://")[1], timeout=300)
        health.request("GET", "/healthz")

        assert health.getresponse().read() == b"OK\n"


@pytest.mark.parametrize("protocol", SERVED)
def test_a_server_with_a_key_refuses_clients_without_it(protocol, monkeypatch):
    """The server's key is *sesame*; one client sends none, and the other one *sesam*.

    401 is the status of HTTP for who may not enter.
    """
    monkeypatch.setenv("KEY", "sesam")
    with served(HERE, protocol, key="sesame") as url:
        for query in ("", "?api_key_env=KEY"):
            with pytest.raises(OSError, match="HTTP status 401"):
                make_policy(url + query, 0).reset(INSTRUCTION, video(0))


@pytest.mark.parametrize("protocol", SERVED)
def test_a_server_with_a_key_serves_a_client_with_the_same_key(protocol, monkeypatch):
    """Both have *sesame*: one chunk of 4 actions of 8 numbers is the answer of the policy."""
    monkeypatch.setenv("KEY", "sesame")
    with served(HERE, protocol, key="sesame") as url:
        chunks, _ = play(f"{url}?api_key_env=KEY", 0, moment(0, history=()))

    assert np.shape(chunks) == (1, 4, 8)


def test_a_client_whose_variable_holds_no_key_is_refused(monkeypatch):
    """The client takes its key from the variable KEY, which is not set."""
    monkeypatch.delenv("KEY", raising=False)

    with (
        served(HERE, "openpi", key="sesame") as url,
        pytest.raises(InvalidValueError, match=r"KEY .* holds no key"),
    ):
        make_policy(f"{url}?api_key_env=KEY", 0).reset(INSTRUCTION, video(0))


@pytest.mark.parametrize(
    ("options", "error", "words"),
    [
        ({"spec": "oracle"}, InvalidValueError, "cannot be served"),
        ({"protocol": "mmevla"}, UnknownNameError, "Did you mean 'mme-vla'"),
        ({"protocol": "vla-eval"}, InvalidValueError, "vla-eval:// is for clients only"),
        ({"port": 70000}, InvalidValueError, "Cannot listen on 127.0.0.1:70000"),
        (
            {"spec": f"{__name__}:Seeing"},
            InvalidValueError,
            "declares depth and observe_every, which openpi does not carry; .* do: challenge",
        ),
        (
            {"spec": f"{__name__}:Remembering"},
            InvalidValueError,
            "declares observe_every, which openpi does not carry; .* do: challenge, mme-vla\\.",
        ),
        (
            {"spec": f"{__name__}:Posing", "protocol": "mme-vla"},
            InvalidValueError,
            "declares actions, which mme-vla does not carry; .* do: challenge, openpi\\.",
        ),
    ],
)
def test_a_policy_that_a_protocol_cannot_serve_is_refused_with_the_reason(options, error, words):
    """Asked for is the policy "random" by openpi at a free port, unless the options say otherwise.

    The policies of this file: Remembering wants to see each step, Seeing depth as well, and Posing
    acts in poses; the error names what the protocol does not carry, and the protocols that do.
    """
    place = ServerOptions(port=options.get("port", 0))
    with pytest.raises(error, match=words):
        open_server(options.get("spec", "random"), options.get("protocol", "openpi"), place)


def test_the_command_serve_runs_until_a_signal_ends_it():
    """143 is 128 + 15, the number of SIGTERM."""
    with serving("mme-vla") as server:
        assert server.url.startswith("mme-vla://127.0.0.1:")

        chunks, _ = play(server.url, 2, moment(2, history=()))
        assert np.shape(chunks) == (1, 16, 8)

        server.process.send_signal(signal.SIGTERM)
        assert server.process.wait(300) == 143
