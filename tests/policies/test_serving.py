"""Policies of this process behind real sockets: inputs, outputs and errors."""

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
    """Depending on the protocol: some carry neither video nor history."""
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
    first, _ = served_episodes("openpi")
    assert len(first.demonstration["joint_positions"]) == 0


@pytest.mark.parametrize("protocol", SERVED)
def test_a_served_policy_hears_each_new_sentence_of_a_growing_prompt(protocol):
    said = ["this one is red.", "please note.", "please note.", "take it."]
    chunks = [(), (moment(1), moment(2)), (moment(3),), (moment(4), moment(5))]
    moments = [
        {**moment(number), "history": seen, "instruction": text}
        for number, text, seen in zip((0, 2, 3, 5), said, chunks, strict=True)
    ]
    with served(HERE, protocol) as url:
        for length in (3, 2):  # the second episode has steps of its own
            play(url, length, *moments)

    *_, policy = Recorder.episodes

    assert [call["instruction"] for call in policy.calls] == said
    if protocol == "openpi":  # has no reset: a new prompt is a new episode
        assert (policy.instruction, policy.heard) == ("take it.", [])
    else:
        assert policy.instruction == "this one is red."
        assert policy.heard == [("please note.", 2), ("take it.", 5)]


def test_a_served_policy_sees_depth_and_calibration_if_the_client_sends_them():
    moments = [moment(number, sensors=True) for number in range(6)]
    first = {**moments[3], "history": ()}
    later = {**moments[5], "history": (moments[4], moments[5])}

    with served(f"{__name__}:Seeing", "challenge") as url:
        play(f"{url}?depth=yes&calibration=yes", 3, first, later, sensors=True)

    _opened, policy = Recorder.episodes
    shown = [field for field in moments[0] if field != "instruction"]
    check_same(video(3, sensors=True), policy.demonstration, shown)
    check_same(first, policy.calls[0], shown)
    for given, kept in zip(later["history"], policy.calls[1]["history"], strict=True):
        check_same(given, kept, shown)
    assert policy.calls[1]["front_depth"].dtype == np.int16


def test_a_request_whose_lists_differ_in_length_is_refused():
    names = ("front_rgb", "wrist_rgb", "joint_state", "eef_state", "gripper_state")
    request = {f"{name}_list": [np.zeros(3)] * 2 for name in names}
    request |= {"task_goal": ["go"], "is_first_step": True, "front_depth_list": [np.zeros(3)]}
    with served(HERE, "challenge") as url, connect(url.replace("challenge", "ws")) as raw:
        raw.recv()
        raw.send(pack(request))
        assert "front_depth_list must be lists of the same length" in raw.recv()


def reply_to(raw, message):
    raw.send(pack(message))
    return unpack(raw.recv())


@pytest.mark.parametrize("kind", ["grounded", "simple"])
def test_connections_to_an_mme_vla_server_share_one_policy(kind):
    """The video is sent over one connection, the question over another."""
    frames = np.stack([moment(number)["front_rgb"][None] for number in range(3)])
    states = np.zeros((3, 8), np.float32)
    shown = {"add_buffer": True, "images": frames, "state": states, "exec_start_idx": 2}
    request = {
        "observation/image": frames[2, 0],
        "observation/wrist_image": frames[2, 0],
        "observation/state": np.zeros(8),
        "prompt": "go",
        f"{kind}_subgoal": "pick up the cube at <1, 2>",
    }
    with served(HERE, "mme-vla") as url:
        place = url.replace("mme-vla", "ws")
        with connect(place) as first, connect(place) as second:
            assert unpack(first.recv())["policy"] == HERE
            second.recv()
            assert len(Recorder.episodes) == 1  # idle connections make no policy

            reply = reply_to(first, {"reset": True})
            assert reply["reset_finished"] is True
            assert isinstance(reply["reset_time_ms"], float)
            reply = reply_to(first, shown)
            assert reply["add_buffer_finished"] is True
            assert isinstance(reply["add_buffer_time_ms"], float)
            reply = reply_to(second, request)
            assert reply["actions"].shape == (4, 8)
            assert set(reply) == {"actions", "infer_time_ms"}

    _opened, policy = Recorder.episodes
    assert np.array_equal(policy.demonstration["front_rgb"], frames[:2, 0])
    assert policy.subgoals == ["pick up the cube at <1, 2>"]


@pytest.mark.parametrize(
    ("message", "words"),
    [
        (b"\xc1", "the bytes are not a msgpack message"),
        (pack({}), "'observation/state' must be real numbers (8); got nothing"),
        (pack({"add_buffer": True, "images": np.zeros((2, 4, 4, 3), np.uint8)}), "'images' must"),
        ("hello", "Messages must be binary"),
    ],
)
def test_a_malformed_request_is_answered_by_a_traceback_and_close_code_1011(message, words):
    with served(HERE, "mme-vla") as url:
        with connect(url.replace("mme-vla", "ws")) as raw:
            raw.recv()
            raw.send(message)
            text = raw.recv()
            assert text.startswith("Traceback")
            assert words in text
            with pytest.raises(ConnectionClosedError) as closed:
                raw.recv()
            assert closed.value.rcvd.code == 1011
        assert play(url, 0, moment(0, history=()))


@pytest.mark.parametrize("protocol", SERVED)
def test_an_exception_in_a_served_policy_reaches_the_client_with_its_message(protocol):
    with served(HERE, protocol) as url:
        client = make_policy(url, 0)
        client.reset("fail", video(1))
        with pytest.raises(PolicyReplyError, match="RuntimeError: the weights melted"):
            client.act({**moment(1, history=()), "instruction": "fail"})

        client.close()
        assert play(url, 1, moment(1, history=()))


@pytest.mark.parametrize("protocol", SERVED)
def test_a_server_reports_its_health_and_refuses_other_keys(protocol, monkeypatch):
    with served(HERE, protocol, key="sesame") as url:
        health = HTTPConnection(url.split("://")[1], timeout=300)
        health.request("GET", "/healthz")
        assert health.getresponse().read() == b"OK\n"

        monkeypatch.delenv("KEY", raising=False)
        with pytest.raises(InvalidValueError, match=r"KEY .* holds no key"):
            make_policy(f"{url}?api_key_env=KEY", 0).reset(INSTRUCTION, video(0))

        monkeypatch.setenv("KEY", "sesam")
        for query in ("", "?api_key_env=KEY"):
            with pytest.raises(OSError, match="HTTP status 401"):
                make_policy(url + query, 0).reset(INSTRUCTION, video(0))

        monkeypatch.setenv("KEY", "sesame")
        client = make_policy(f"{url}?api_key_env=KEY", 0)
        client.reset(INSTRUCTION, video(0))
        client.close()


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
