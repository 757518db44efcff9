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


def kinds(server):
    return [kind for kind, _ in server.payloads]


def wait_for_messages(server, count):
    deadline = time.monotonic() + 300
    while len(server.payloads) < count and time.monotonic() < deadline:
        time.sleep(0.01)


def described(array):
    """Kind and content of what was sent."""
    return f"{array.dtype} {array.shape} {hashlib.sha256(array.tobytes()).hexdigest()[:8]}"


def test_an_episode_is_what_the_harness_would_send(snapshot):
    """All messages of an episode, compared with stored ones."""
    with VlaEvalServer() as server:
        with client_of(server, "vla-eval") as client:
            client.reset(INSTRUCTION, video(3))
            rows = [client.act(moment(n, history=())) for n in (3, 4)]
        wait_for_messages(server, 5)
    assert client.metadata["model_server"] == "Test"
    assert server_version(client.metadata) == "Test, vla-eval 0.8.0"
    assert [row.tolist() for row in rows] == [[[1.0] * 8], [[2.0] * 8]]

    sent = json.dumps(server.payloads, indent=1, default=described)
    assert re.sub(r"roboirg [\d.]+", "roboirg", sent) == snapshot


def test_observations_without_a_video_have_no_history_and_carry_the_subgoal():
    with VlaEvalServer() as server, client_of(server, "vla-eval") as client:
        client.reset(INSTRUCTION, video(0))
        client.follow("pick it up at <1, 2>")
        client.act(moment(0))
        client.act({**moment(1), "instruction": "said later"})
        client.reset(INSTRUCTION, video(0))
        client.act(moment(0))
    shown = [payload for kind, payload in server.payloads if kind == "observation"]

    assert [message.get("subgoal") for message in shown] == ["pick it up at <1, 2>"] * 2 + [None]
    assert shown[1]["task_description"] == "said later"
    assert "video_history" not in shown[0]
    assert "episode_restart" not in shown[0]


@pytest.mark.parametrize(
    ("query", "wishes"),
    [
        ("?wrist=no&state=no&video=no", {}),
        (
            "",
            {
                "send_wrist_image": False,
                "send_state": False,
                "send_video_history": False,
                "something": "else",
            },
        ),
    ],
)
def test_options_of_the_server_or_the_url_leave_out_camera_state_and_video(query, wishes):
    with VlaEvalServer() as server:
        server.hello = {**server.hello, "observation_params": wishes}
        with client_of(server, "vla-eval", query) as client:
            assert client.cameras == (("front",) if query else ("front", "wrist"))
            assert client.demonstration_frames == ("none" if query else "all")
            client.reset(INSTRUCTION, video(2))
            client.act(moment(0))
    ((_, shown),) = [payload for payload in server.payloads if payload[0] == "observation"]

    assert list(shown) == ["images", "task_description"]
    assert list(shown["images"]) == ["agentview"]


@pytest.mark.parametrize(
    ("params", "left_out"),
    [
        (None, set()),
        ({}, set()),
        ({"send_state": False}, {"states"}),
        ({"send_video_history": False}, {"video_history", "wrist_video_history"}),
    ],
)
def test_a_server_is_shown_all_that_it_does_not_refuse(params, left_out):
    """It may say nothing of what it wants, or only of a part."""
    with VlaEvalServer() as server:
        server.hello = {**server.hello, "observation_params": params}
        with client_of(server, "vla-eval") as client:
            client.reset(INSTRUCTION, video(2))
            client.act(moment(0))
    ((_, shown),) = [payload for payload in server.payloads if payload[0] == "observation"]

    what_it_can_refuse = {"states", "video_history", "wrist_video_history"}
    assert shown.keys() & what_it_can_refuse == what_it_can_refuse - left_out
    assert list(shown["images"]) == ["agentview", "wrist"]


def test_a_server_with_another_action_space_or_protocol_version_is_refused():
    with VlaEvalServer() as server, client_of(server, "vla-eval") as client:
        server.hello = {**server.hello, "observation_params": {"action_space": "ee_pose"}}
        with pytest.raises(InvalidValueError, match="'ee_pose', but the policy's URL says actions"):
            client.reset(INSTRUCTION, video(0))

        with client_of(server, "vla-eval", "?actions=ee_pose") as agreed:
            agreed.reset(INSTRUCTION, video(0))
        server.hello = {**server.hello, "protocol_version": 2}
        with pytest.raises(PolicyReplyError, match="speaks version 2 of vla-eval's protocol"):
            client.reset(INSTRUCTION, video(0))
        server.hello = {**server.hello, "protocol_version": np.ones(2)}
        with pytest.raises(PolicyReplyError, match=r"speaks version \[1\.0, 1\.0\] of vla-eval's"):
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
        ({"other": 1}, "without 'actions'; it holds 'other'"),
        ({"status": "error", "message": "no memory"}, "replied with an error: no memory"),
    ],
)
def test_a_malformed_reply_of_a_vla_eval_server_ends_only_its_episode(fault, words):
    with VlaEvalServer(faults=[fault]) as server, client_of(server, "vla-eval") as client:
        client.reset(INSTRUCTION, video(0))
        with pytest.raises(PolicyReplyError, match=words):
            client.act(moment(0))

        client.reset(INSTRUCTION, video(0))
        assert len(client.act(moment(0))) == 1


@pytest.mark.parametrize("name", ["actions", "action"])
@pytest.mark.parametrize("action", [[0.5] * 8, np.full((1, 8), 0.5), np.full(8, 0.5, np.float16)])
def test_actions_are_read_under_both_names_and_in_any_shape(name, action):
    with VlaEvalServer(faults=[{name: action}]) as server, client_of(server, "vla-eval") as client:
        client.reset(INSTRUCTION, video(0))
        assert client.act(moment(0)).tolist() == [[0.5] * 8]


def test_an_error_of_the_server_is_reported_with_its_words():
    class Failing(VlaEvalServer):
        def answer(self, message):
            raise RuntimeError("observation_failed: the weights melted \x1b[2J")

    with Failing() as server, client_of(server, "vla-eval") as client:
        client.reset(INSTRUCTION, video(0))
        with pytest.raises(PolicyReplyError, match=r"the weights melted \\x1b\[2J\.$"):
            client.act(moment(0))
    with VlaEvalServer(faults=["late-error"]) as server, client_of(server, "vla-eval") as client:
        client.reset(INSTRUCTION, video(0))
        with pytest.raises(PolicyReplyError, match="replied with an error: cannot start"):
            client.act(moment(0))
