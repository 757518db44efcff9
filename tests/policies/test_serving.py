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
def recorders():
    """The policies (of the class Recorder) that a server has made, in their order: one when it is
    opened, and then one for each episode.
    """
    Recorder.episodes.clear()
    return Recorder.episodes


def check_same(given, kept, fields):
    for field in fields:
        assert np.array_equal(given[field], kept[field]), field


def play(url, length, *moments, **more):
    """Play an episode at a server, with a video of that length; return the chunks of actions that
    the client got, one for each moment.
    """
    client = make_policy(url, 0)
    client.reset(moments[0]["instruction"], video(length, **more))
    chunks = [client.act(seen).tolist() for seen in moments]
    client.close()
    return chunks


def recorder_behind(protocol, *moments, spec=HERE, options="", **more):
    """Return the policy behind a server, which has written down an episode of a client: a video of
    the moments 0 to 2, and then a question at each of these moments.
    """
    with served(spec, protocol) as url:
        play(f"{url}{options}", 3, *moments, **more)
    return Recorder.episodes[-1]


FIRST = moment(3, history=())
"""What a client shows at the first question, after a video of the moments 0 to 2."""
SECOND = moment(5, history=(moment(4), moment(5)))
"""What it shows at the second question, with all moments since the first in the history."""


@pytest.mark.parametrize("protocol", SERVED)
def test_a_server_makes_a_policy_for_each_episode_and_closes_it(recorders, protocol):
    """The policy of a server with seed 7 counts its calls in its actions, which are all 1 in the
    first chunk. In the second episode the count begins anew, with another policy.
    """
    with served(HERE, protocol, seed=7) as url:
        first_chunks = play(url, 3, FIRST)
        second_chunks = play(url, 3, FIRST)

    _opened, first, second = recorders
    assert (first.seed, first.closed) == (7, True)
    assert (second.seed, second.closed) == (7, True)
    assert first_chunks == second_chunks == [[[1] * 8] * 4]


@pytest.mark.parametrize("protocol", SERVED)
def test_the_client_of_a_served_policy_has_its_metadata(protocol):
    """The policy Recorder declares that it has no network; the server adds the rest."""
    with served(HERE, protocol) as url:
        client = make_policy(url, 0)
        client.reset(INSTRUCTION, video(0))
        client.close()

    expected = {
        "policy": HERE, "network": "none", "protocol": protocol,
        "python": platform.python_version(),
    }  # fmt: skip
    assert expected.items() <= client.metadata.items()


@pytest.mark.parametrize(
    ("protocol", "instruction"),
    [
        ("openpi", "Put the Red cube on the target."),
        ("challenge", "Put the Red cube on the target."),
        ("mme-vla", "put the red cube on the target."),
    ],
)
def test_a_served_policy_gets_the_instruction_lowered_by_mme_vla(protocol, instruction):
    """The client says *Put the Red cube on the target.*"""
    assert recorder_behind(protocol, FIRST).instruction == instruction


@pytest.mark.parametrize(
    ("protocol", "fields"),
    [
        ("openpi", ["front_rgb", "wrist_rgb", "joint_positions"]),
        ("mme-vla", ["front_rgb", "wrist_rgb", "joint_positions"]),
        ("challenge", ["front_rgb", "wrist_rgb", "joint_positions", "gripper", "end_effector"]),
    ],
)
def test_a_served_policy_sees_what_its_client_was_shown(protocol, fields):
    """A client is shown FIRST and SECOND, and the policy behind the server keeps what it sees
    (`calls`): the `fields` that the protocol carries as they are. Of the gripper, most protocols
    carry one number, the position of its first finger; the policy sees two fingers all the same.
    """
    first, second = recorder_behind(protocol, FIRST, SECOND).calls

    check_same(FIRST, first, fields)
    check_same(SECOND, second, fields)
    assert first["gripper"].shape == (2,)
    assert first["gripper"][0] == FIRST["gripper"][0]


VIDEO_FIELDS = pytest.mark.parametrize(
    ("protocol", "fields"),
    [
        ("mme-vla", ["front_rgb", "joint_positions"]),
        ("challenge", ["front_rgb", "wrist_rgb", "joint_positions", "gripper", "end_effector"]),
    ],
)
"""What protocols carry of each moment of a video or a history."""


@VIDEO_FIELDS
def test_a_served_policy_sees_the_video(recorders, protocol, fields):
    """Two episodes have videos of three and of two moments; nothing of the first is in the second.

    `fields` are those that the protocol carries of a video.
    """
    with served(HERE, protocol) as url:
        play(url, 3, FIRST)
        play(url, 2, FIRST)

    _opened, first, second = recorders
    check_same(video(3), first.demonstration, fields)
    check_same(video(2), second.demonstration, fields)


@VIDEO_FIELDS
def test_a_served_policy_sees_the_moments_between_two_questions(protocol, fields):
    """The first question shows moment 3, and nothing before it. The second one shows moment 5, with
    the moments 4 and 5 since the first as its history.

    `fields` are those that the protocol carries of a history.
    """
    first, second = recorder_behind(protocol, FIRST, SECOND).calls

    earlier, newest = second["history"]
    assert len(first["history"]) <= 1  # at most moment 3 itself
    check_same(moment(4), earlier, fields)
    check_same(moment(5), newest, fields)


def test_a_policy_that_is_served_by_openpi_gets_no_video():
    """The client has a video of three moments, which openpi has no message for."""
    policy = recorder_behind("openpi", FIRST)

    assert len(policy.demonstration["joint_positions"]) == 0


def saying(text, number, *since):
    """Return what a client shows at a moment: the text said last, and the moments since."""
    return {**moment(number, history=map(moment, since)), "instruction": text}


@pytest.mark.parametrize("protocol", ["mme-vla", "challenge"])
def test_a_served_policy_hears_each_new_sentence_of_a_growing_prompt(recorders, protocol):
    """At steps 0, 2, 3 and 5 a client asks for actions; its prompt changes at steps 2 and 5.

    The first text is the instruction; the policy hears the others, with their steps. So it does in
    a second episode, whose steps are counted from its own beginning.
    """
    asked = [
        saying("this one is red.", 0),
        saying("please note.", 2, 1, 2),
        saying("please note.", 3, 3),
        saying("take it.", 5, 4, 5),
    ]

    with served(HERE, protocol) as url:
        play(url, 3, *asked)
        play(url, 2, *asked)

    _opened, *episodes = recorders
    for policy in episodes:
        assert policy.instruction == "this one is red."
        assert policy.heard == [("please note.", 2), ("take it.", 5)]


def test_openpi_has_no_reset_so_that_a_new_prompt_is_a_new_episode():
    """A client asks twice in one episode, and its prompt changes in between.

    With openpi the server cannot tell this from a new episode. So the policy begins one, with the
    second text as its instruction, and hears nothing in it.
    """
    asked = [saying("this one is red.", 0), saying("take it.", 2, 1, 2)]

    policy = recorder_behind("openpi", *asked)

    assert policy.instruction == "take it."
    assert policy.heard == []


def test_a_served_policy_sees_depth_and_calibration_if_the_client_sends_them():
    """The policy `Seeing` wants depth and the moment of each step. The client shows moments that
    have depth and the cameras' matrices, too: first moment 3, and then the moments 4 and 5.

    All fields of what it sees are equal to what the client was shown; depth is in whole numbers.
    """
    before, between, now = (moment(number, sensors=True) for number in (3, 4, 5))
    fields = [field for field in now if field != "instruction"]
    asked = [{**before, "history": ()}, {**now, "history": (between, now)}]
    with_sensors = {"options": "?depth=yes&calibration=yes", "sensors": True}

    policy = recorder_behind("challenge", *asked, spec=f"{__name__}:Seeing", **with_sensors)

    first, second = policy.calls
    check_same(video(3, sensors=True), policy.demonstration, fields)
    check_same(before, first, fields)
    for given, seen in zip((between, now), second["history"], strict=True):
        check_same(given, seen, fields)
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


@pytest.mark.parametrize("kind", ["grounded", "simple"])
def test_connections_to_an_mme_vla_server_share_one_policy(recorders, kind):
    """A server of MME-VLA has one memory for all connections.

    Over the first one come three frames, of which the first two (`exec_start_idx`) are the video,
    and over the second one the question, with a subgoal. One policy has seen the video and follows
    the subgoal.
    """
    frames = np.stack([moment(number)["front_rgb"][None] for number in range(3)])
    shown = {"images": frames, "state": np.zeros((3, 8), np.float32), "exec_start_idx": 2}
    question = {
        "observation/image": frames[2, 0],
        "observation/wrist_image": frames[2, 0],
        "observation/state": np.zeros(8),
        "prompt": "go",
        f"{kind}_subgoal": "pick up the cube at <1, 2>",
    }

    with served(HERE, "mme-vla") as url, opened(url) as first, opened(url) as second:
        answers = [
            reply_to(first, {"reset": True}),
            reply_to(first, {"add_buffer": True, **shown}),
            reply_to(second, question),
        ]

    assert [set(answer) for answer in answers] == [
        {"reset_finished", "reset_time_ms"},
        {"add_buffer_finished", "add_buffer_time_ms"},
        {"actions", "infer_time_ms"},
    ]
    _opened, policy = recorders
    assert np.array_equal(policy.demonstration["front_rgb"], frames[:2, 0])
    assert policy.subgoals == ["pick up the cube at <1, 2>"]


def test_idle_connections_make_no_policy(recorders):
    """The only one is that with which the server was opened."""
    with served(HERE, "mme-vla") as url, opened(url), opened(url):
        assert len(recorders) == 1


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

        chunks = play(url, 0, moment(0, history=()))

    assert np.shape(chunks) == (1, 4, 8)


@pytest.mark.parametrize("protocol", SERVED)
def test_an_exception_in_a_served_policy_reaches_the_client_with_its_message(protocol):
    """The policy Recorder raises *the weights melted* if the instruction begins with *fail*. The
    next episode works.
    """
    now = moment(1, history=())
    with served(HERE, protocol) as url:
        with pytest.raises(PolicyReplyError, match="RuntimeError: the weights melted"):
            play(url, 1, {**now, "instruction": "fail"})

        assert play(url, 1, now)


@pytest.mark.parametrize("protocol", SERVED)
def test_a_server_reports_its_health_to_anyone(protocol):
    """The server's key is *sesame*. A request for the path /healthz without it is answered *OK*."""
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
        chunks = play(f"{url}?api_key_env=KEY", 0, moment(0, history=()))

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
    spec = options.get("spec", "random")
    protocol = options.get("protocol", "openpi")
    with pytest.raises(error, match=words):
        open_server(spec, protocol, ServerOptions(port=0))


def test_the_command_serve_runs_until_a_signal_ends_it():
    """The command serves the random policy, of whose chunk 16 actions of 8 numbers are executed.
    SIGTERM ends it with exit code 143, which is 128 + 15, the number of that signal.
    """
    with serving("mme-vla") as server:
        assert server.url.startswith("mme-vla://127.0.0.1:")

        chunks = play(server.url, 2, moment(2, history=()))
        assert np.shape(chunks) == (1, 16, 8)

        server.process.send_signal(signal.SIGTERM)
        assert server.process.wait(300) == 143
