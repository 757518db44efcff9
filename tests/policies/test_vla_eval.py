"""vla-eval's model servers: what they are shown, what they answer, and what goes wrong."""

import hashlib
import json
import re
import time

import numpy as np
import pytest
from wire_episode import INSTRUCTION, client_of, moment, video
from wire_servers import VlaEvalServer

from roboirg.core.errors import InvalidValueError, PolicyReplyError
from roboirg.policies.contract.policy_calls import server_version


@pytest.fixture
def server():
    """A model server of vla-eval (a stand-in), which writes down what it gets."""
    with VlaEvalServer() as opened:
        yield opened


@pytest.fixture
def client(server):
    """A policy that asks the server of the fixture."""
    with client_of(server, "vla-eval") as policy:
        yield policy


def shown_to(server):
    """Return the only observation that a server was sent."""
    (found,) = [payload for kind, payload in server.payloads if kind == "observation"]
    return found


def wait_for_messages(server, count):
    deadline = time.monotonic() + 300
    while len(server.payloads) < count and time.monotonic() < deadline:
        time.sleep(0.01)


def described(array):
    """Kind and content of what was sent."""
    return f"{array.dtype} {array.shape} {hashlib.sha256(array.tobytes()).hexdigest()[:8]}"


def test_an_episode_is_what_the_harness_would_send(server, client, snapshot):
    """The client sends what vla-eval's own harness does: it greets, starts an episode, shows each
    moment, and ends the episode.

    The stored payloads have the video, three pictures of each camera, in the first observation
    alone. Each array stands there as its type, shape and a checksum.
    """
    client.reset(INSTRUCTION, video(3))
    client.act(moment(3))
    client.act(moment(4))
    client.close()
    wait_for_messages(server, 5)

    kinds = [kind for kind, _ in server.payloads]
    assert kinds == ["hello", "episode_start", "observation", "observation", "episode_end"]
    sent = json.dumps(server.payloads, indent=1, default=described)
    assert re.sub(r"roboirg [\d.]+", "roboirg", sent) == snapshot  # without our version


def test_the_version_of_a_server_is_its_name_and_that_of_vla_eval(client):
    """The server (a stand-in) says in its hello that it is *Test*, with vla-eval 0.8.0."""
    client.reset(INSTRUCTION, video(0))

    assert client.metadata["model_server"] == "Test"
    assert server_version(client.metadata) == "Test, vla-eval 0.8.0"


def test_without_a_video_no_video_is_sent(server, client):
    """The mark that an episode begins anew (`episode_restart`) belongs to the video."""
    client.reset(INSTRUCTION, video(0))
    client.act(moment(1))

    assert not shown_to(server).keys() & {"video_history", "episode_restart"}


def test_a_server_is_shown_what_was_said_last(server, client):
    client.reset("Put it there.", video(0))
    client.act({**moment(1), "instruction": "And now the other one."})

    assert shown_to(server)["task_description"] == "And now the other one."


def test_a_subgoal_is_sent_with_each_observation_of_its_episode(server, client):
    """Two observations of the first episode have it; that of the second, which begins anew, has
    none.
    """
    client.reset(INSTRUCTION, video(0))
    client.follow("pick it up at <1, 2>")
    client.act(moment(0))
    client.act(moment(1))
    client.reset(INSTRUCTION, video(0))
    client.act(moment(0))

    subgoals = [shown.get("subgoal") for kind, shown in server.payloads if kind == "observation"]
    assert subgoals == ["pick it up at <1, 2>", "pick it up at <1, 2>", None]


WISHES = {"send_wrist_image": False, "send_state": False, "send_video_history": False}


@pytest.mark.parametrize(
    ("query", "wishes"),
    [("?wrist=no&state=no&video=no", {}), ("", WISHES)],
    ids=["options of the URL", "wishes of the server"],
)
def test_options_of_the_server_or_the_url_leave_out_camera_state_and_video(server, query, wishes):
    """Both say no to the wrist camera, the robot's state and the video: the URL, or the server's
    hello.

    What is left of the first message is the front camera (*agentview*) and the instruction.
    """
    server.hello = {**server.hello, "observation_params": wishes}
    with client_of(server, "vla-eval", query) as client:
        client.reset(INSTRUCTION, video(2))
        client.act(moment(0))

    assert list(shown_to(server)) == ["images", "task_description"]
    assert list(shown_to(server)["images"]) == ["agentview"]


def test_a_client_that_leaves_out_camera_and_video_does_not_need_them(server, client):
    """`cameras` and `demonstration_frames` tell the environment what it has to draw. The client of
    the fixture leaves nothing out.
    """
    with client_of(server, "vla-eval", "?wrist=no&video=no") as modest:
        assert modest.cameras == ("front",)
        assert modest.demonstration_frames == "none"
    assert client.cameras == ("front", "wrist")
    assert client.demonstration_frames == "all"


@pytest.mark.parametrize(
    ("params", "shown"),
    [
        (None, {"states", "video_history", "wrist_video_history"}),
        ({"something": "else"}, {"states", "video_history", "wrist_video_history"}),
        ({"send_state": False}, {"video_history", "wrist_video_history"}),
        ({"send_video_history": False}, {"states"}),
    ],
    ids=["says nothing", "says something else", "no state", "no video"],
)
def test_a_server_is_shown_all_that_it_does_not_refuse(server, client, params, shown):
    """`params` are the server's wishes in its hello, and `shown` the fields that it then gets.

    Images, the instruction and the mark of a new episode are always sent, so they are left out
    here.
    """
    server.hello = {**server.hello, "observation_params": params}

    client.reset(INSTRUCTION, video(2))
    client.act(moment(0))

    assert shown_to(server).keys() - {"images", "task_description", "episode_restart"} == shown
    assert list(shown_to(server)["images"]) == ["agentview", "wrist"]


@pytest.mark.parametrize(
    ("hello", "error", "reason"),
    [
        (
            {"observation_params": {"action_space": "ee_pose"}},
            InvalidValueError,
            "'ee_pose', but the policy's URL says actions",
        ),
        ({"protocol_version": 2}, PolicyReplyError, "speaks version 2 of vla-eval's protocol"),
        (
            {"protocol_version": np.ones(2)},
            PolicyReplyError,
            r"speaks version \[1\.0, 1\.0\] of vla-eval's",
        ),
    ],
    ids=["action space", "version", "a version that is no number"],
)
def test_a_server_with_another_action_space_or_protocol_version_is_refused(
    server, client, hello, error, reason
):
    """The client acts in joint angles (*actions*) and speaks version 1 of the protocol."""
    server.hello = {**server.hello, **hello}

    with pytest.raises(error, match=reason):
        client.reset(INSTRUCTION, video(0))


def test_a_server_with_another_action_space_is_used_if_the_url_agrees(server):
    """Server and URL both say *ee_pose*; then the reset succeeds."""
    server.hello = {**server.hello, "observation_params": {"action_space": "ee_pose"}}
    with client_of(server, "vla-eval", "?actions=ee_pose") as client:
        client.reset(INSTRUCTION, video(0))


@pytest.mark.parametrize(
    ("fault", "words"),
    [
        ("other-type", "type 'hello' with number 3, where 'action' with number 3"),
        ("other-number", "type 'action' with number 4, where 'action' with number 3"),
        (b"\xc1", "something other than a message"),
        ("text", "replied with an error: text"),
        ({"actions": np.zeros(7)}, r"got shape \(7,\)"),
        (
            {"actions": [[1.0], [2.0, 3.0]]},
            "numbers, got rows of different lengths",
        ),
        ({"status": "error", "message": "no memory"}, "replied with an error: no memory"),
    ],
)
def test_a_malformed_reply_of_a_vla_eval_server_ends_only_its_episode(server, client, fault, words):
    """`fault` replaces the server's first reply: a message of another type or number, bytes that
    are no message, or actions that are no array of 8 numbers. `words` are in the error.

    The next episode of the same client gets its action.
    """
    server.faults = [fault]
    client.reset(INSTRUCTION, video(0))
    with pytest.raises(PolicyReplyError, match=words):
        client.act(moment(0))

    client.reset(INSTRUCTION, video(0))
    assert len(client.act(moment(0))) == 1


@pytest.mark.parametrize("name", ["actions", "action"])
@pytest.mark.parametrize("action", [[0.5] * 8, np.full((1, 8), 0.5), np.full(8, 0.5, np.float16)])
def test_actions_are_read_under_both_names_and_in_any_shape(server, client, name, action):
    """A server may call the eight numbers *actions* or *action*, and send them as a list or an
    array, with or without a first axis. All are read as one row.
    """
    server.faults = [{name: action}]
    client.reset(INSTRUCTION, video(0))

    assert client.act(moment(0)).tolist() == [[0.5] * 8]


class FailingServer(VlaEvalServer):
    """Raises an error with codes that would clear a terminal."""

    def answer(self, message):
        raise RuntimeError("observation_failed: the weights melted \x1b[2J")


def test_an_error_of_the_server_is_reported_with_its_words():
    with FailingServer() as server, client_of(server, "vla-eval") as client:
        client.reset(INSTRUCTION, video(0))

        with pytest.raises(PolicyReplyError, match=r"the weights melted \\x1b\[2J\.$"):
            client.act(moment(0))


def test_an_error_at_the_start_of_an_episode_is_reported_at_the_first_step(server, client):
    server.faults = ["late-error"]
    client.reset(INSTRUCTION, video(0))

    with pytest.raises(PolicyReplyError, match="replied with an error: cannot start"):
        client.act(moment(0))
