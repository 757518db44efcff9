"""Servers that die, stall, restart, or reply late or malformed: named errors, and recovery."""

import contextlib
import os
import socket
import threading
import time

import numpy as np
import pytest
from attackers import answering, frame, shake_hands
from wire_episode import INSTRUCTION, client_of, moment, video
from wire_servers import ChallengeServer, MmeVlaServer, WireServer, pack

from roboirg.core.errors import (
    PolicyConnectionError,
    PolicyReplyError,
    PolicyTimeoutError,
)
from roboirg.policies import make_policy

PROTOCOLS = {
    "openpi": WireServer,
    "mme-vla": MmeVlaServer,
    "challenge": ChallengeServer,
}


def play_episode(policy, *, steps=1):
    """Play an episode with a video of two moments; return the actions of each step."""
    policy.reset(INSTRUCTION, video(2))
    chunks = []
    for number in range(steps):
        now = moment(2 + number)
        chunks.append(policy.act({**now, "history": (now,) * number}))
    return chunks


def failing_at_inference(protocol, fault):
    """A server that answers all as it should but the first request for actions."""
    messages_before = {"openpi": 0, "mme-vla": 2, "challenge": 1}
    return PROTOCOLS[protocol](faults=[None] * messages_before[protocol] + [fault])


@pytest.mark.parametrize(
    ("reply", "words"),
    [
        ("Traceback …\nValueError: the weights melted\n", "error: ValueError: the weights melted."),
        ("", "error: an empty text"),
        (b"\xc1\xff\x00", "something other than a message: the bytes are not a msgpack"),
        (pack([1, 2]), "the message is of type list, not a map"),
        (pack({b"x": 2}), "key b.x. that is not a text"),
        ({"action": np.zeros((20, 8))}, "without 'actions'; it holds 'action'"),
        ({"actions": np.zeros((20, 7))}, r"shape \(n, 8\) with n >= 1, got shape \(20, 7\)"),
        ({"actions": {"__numpy__": "AAAA", "dtype": "<f8"}}, "dialect .keys '__numpy__', 'dtype'."),
        ({"actions": np.zeros((200_000, 8))}, "more than 1 MiB; option max_reply_mib"),
    ],
)
def test_a_malformed_reply_is_reported_with_the_server_that_sent_it(reply, words):
    """The server answers the question for actions with `reply`: a text is an error by protocol,
    bytes are sent as they are, and maps are encoded.

    Right would be an array of (n, 8) finite numbers under *actions*, in a message of 1 MiB at most
    (the client's option). The error says in `words` what is wrong, and names the server.
    """
    with (
        WireServer(faults=[reply]) as server,
        client_of(server, "openpi", "?max_reply_mib=1") as policy,
        pytest.raises(PolicyReplyError, match=words) as caught,
    ):
        play_episode(policy)

    assert server.place in str(caught.value)


@pytest.mark.parametrize("protocol", PROTOCOLS)
@pytest.mark.parametrize(
    "reply",
    [
        {"status": "error", "message": "CUDA out of memory"},
        {"error": {"code": 1, "detail": "CUDA out of memory."}},
        {"error": True, "traceback": "Traceback:\n  a\nCUDA out of memory\n"},
    ],
)
def test_an_error_in_a_reply_is_shown_in_the_words_of_the_server(protocol, reply):
    """It comes in place of the confirmed reset, or of the actions where there is no reset."""
    with (
        PROTOCOLS[protocol](faults=[reply]) as server,
        client_of(server, protocol) as policy,
        pytest.raises(PolicyReplyError, match=r"with an error: CUDA out of memory\.$"),
    ):
        play_episode(policy)


def test_an_error_in_place_of_the_metadata_is_shown():
    """A server sends its metadata before anything else; here it sends an error, with a message."""
    with WireServer() as server, client_of(server, "openpi") as policy:
        server.metadata = {"status": "error", "message": "The checkpoint is missing."}
        with pytest.raises(PolicyReplyError, match="with an error: The checkpoint is missing"):
            play_episode(policy)


def test_a_server_that_takes_smaller_messages_only_is_not_taken_for_one_that_sends_larger_ones():
    """The first observation takes 649 bytes, the server reads 500.

    Its close code, 1009, is also the one for replies above max_reply_mib.
    """
    with (
        WireServer(most_bytes=500) as server,
        client_of(server, "openpi") as policy,
        pytest.raises(PolicyReplyError, match="does not take messages of 649 bytes"),
    ):
        play_episode(policy)


def test_the_reason_with_which_a_server_closes_is_shown():
    with (
        WireServer(faults=["close"]) as server,
        client_of(server, "openpi") as policy,
        pytest.raises(PolicyConnectionError, match=r"\(close code 1011: No memory is left\)"),
    ):
        play_episode(policy)


@pytest.mark.parametrize("protocol", ["mme-vla", "challenge"])
def test_a_server_that_does_not_confirm_a_reset_is_an_error(protocol):
    """The server's first reply says that the reset was not done. The next episode is played."""
    with (
        PROTOCOLS[protocol](faults=[{"reset_finished": False}]) as server,
        client_of(server, protocol) as policy,
    ):
        with pytest.raises(PolicyReplyError, match="did not confirm 'reset'"):
            play_episode(policy)
        play_episode(policy)


def test_a_reply_that_takes_longer_than_the_client_waits_is_a_timeout():
    """The server takes five seconds, the client waits for two; the late reply confirms no reset."""
    with (
        failing_at_inference("mme-vla", 5.0) as server,
        client_of(server, "mme-vla", "?timeout=2") as policy,
    ):
        with pytest.raises(PolicyTimeoutError, match="within 2 s"):
            play_episode(policy)

        time.sleep(3)  # until the late reply was sent
        _played_in_time(policy)


class NumberingServer(WireServer):
    """All actions of its n-th reply are n."""

    def answer(self, message):
        return {"actions": np.full((20, 8), float(len(self.messages)))}


def test_a_late_reply_is_not_taken_for_the_next_one():
    """All numbers of the server's n-th reply are n. Reply 1 takes five seconds, and the client
    waits for two: that is a timeout. The reply to the next request is at least the second one.
    """
    with (
        NumberingServer(faults=[5.0]) as server,
        client_of(server, "openpi", "?timeout=2") as policy,
    ):
        with pytest.raises(PolicyTimeoutError):
            play_episode(policy)
        time.sleep(3)  # until reply 1 was sent
        (actions,) = _played_in_time(policy)

    assert actions[0, 0] >= 2


def _played_in_time(policy):
    """Return an episode's rows; with two seconds for a reply a busy machine may be late itself."""
    for _ in range(20):
        with contextlib.suppress(PolicyTimeoutError):
            return play_episode(policy)
    raise AssertionError("the server is always late")


@pytest.mark.parametrize("protocol", PROTOCOLS)
def test_a_server_that_ends_the_connection_ends_the_episode(protocol):
    """It does so at the first request for actions. From then on the policy has to be reset before
    it acts.
    """
    with (
        failing_at_inference(protocol, "die") as server,
        client_of(server, protocol) as policy,
    ):
        with pytest.raises(PolicyConnectionError, match="ended the connection"):
            play_episode(policy)
        with pytest.raises(PolicyConnectionError, match=r"call reset\(\)"):
            policy.act(moment(0, history=()))


@pytest.mark.parametrize("protocol", PROTOCOLS)
def test_the_reset_after_a_lost_connection_connects_again(protocol):
    """The server cuts the connection at the first question. The client then plays two steps."""
    with (
        failing_at_inference(protocol, "die") as server,
        client_of(server, protocol) as policy,
    ):
        with pytest.raises(PolicyConnectionError):
            play_episode(policy)

        assert len(play_episode(policy, steps=2)) == 2


@contextlib.contextmanager
def stalling_server(sent):
    """A server that opens a WebSocket, sends these bytes, and from then on neither sends nor reads;
    yields its place.
    """
    over = threading.Event()

    def stall(peer):
        peer.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
        shake_hands(peer)
        peer.sendall(sent)
        over.wait(600)

    with answering(stall) as place:
        yield place
        over.set()


def test_a_server_that_sends_nothing_is_given_up_after_the_time_to_connect():
    """A server sends its metadata first; this one sends nothing, and the client waits for 2 s."""
    with stalling_server(b"") as place:
        policy = make_policy(f"openpi://{place}?connect=2&timeout=9", 0)

        with pytest.raises(PolicyTimeoutError, match="did not send its metadata within 2 s"):
            policy.reset(INSTRUCTION, {})


def test_a_server_that_reads_nothing_is_given_up_after_the_timeout():
    """The server sends its metadata and then reads nothing; the client tries for 0.5 s to send.

    Pictures of 2048 x 2048 pixels are more than the buffers of the kernel take for the server.
    """
    with stalling_server(frame(pack({}))) as place:
        policy = make_policy(f"openpi://{place}?timeout=0.5", 0)
        policy.reset(INSTRUCTION, {})

        with pytest.raises(PolicyTimeoutError, match=r"did not take in a message within 0\.5 s"):
            policy.act(moment(0, size=2048))


def test_a_second_reply_to_one_request_is_an_error():
    """The server replies twice to the reset. If the client took the second reply for that to its
    next request, it would lag behind by one from then on.
    """
    with MmeVlaServer(faults=["twice"]) as server, client_of(server, "mme-vla") as policy:
        policy.reset(INSTRUCTION, video(0))
        time.sleep(3)  # far more than the second reply takes to arrive on this machine

        with pytest.raises(PolicyReplyError, match="without a request"):
            policy.act(moment(0, history=()))


PORT = 20_000 + os.getpid() % 10_000
"""Below those that the kernel gives away."""


def test_a_client_waits_for_a_server_that_starts_late():
    """The server starts half a second after the client was made, which tries for up to 300 s to
    connect and then plays a step.
    """
    server = MmeVlaServer(port=PORT)
    timer = threading.Timer(0.5, server.__enter__)
    timer.start()
    with client_of(server, "mme-vla", "?connect=300") as policy:
        assert len(play_episode(policy)) == 1

    timer.join()
    server.__exit__()


def test_a_client_finds_a_server_again_that_was_restarted_at_its_port():
    """A server ends after an episode, so that the next act fails; a new one starts at its port, and
    the same client plays an episode there: a video of two moments, and one question.

    The new server was shown 3 frames, 2 of them of the video: the episode from its beginning.
    """
    with MmeVlaServer(port=PORT) as first_server:
        policy = make_policy(f"mme-vla://{first_server.place}?connect=300", 0)
        play_episode(policy)
    with pytest.raises(PolicyConnectionError):
        policy.act(moment(3, history=(moment(3),)))

    with MmeVlaServer(port=PORT) as second_server:
        play_episode(policy)
        policy.close()

    assert second_server.frames == 3
    assert second_server.start == 2


def test_an_absent_server_is_reported_in_one_sentence():
    """No server listens at port 9, and the client tries for 0.2 s."""
    policy = make_policy("openpi://127.0.0.1:9?connect=0.2", 0)
    with pytest.raises(
        PolicyConnectionError,
        match=r"^Policy server openpi://127\.0\.0\.1:9 cannot be reached "
        r"\((nothing listens there|Timeout)",
    ):
        policy.reset(INSTRUCTION, {})


def test_closing_a_policy_closes_its_connection():
    """Three policies connect to a server one after the other, and are closed, each of them twice.
    The server notices soon afterwards: three connections were made, and none is open.
    """
    with WireServer() as server:
        for _ in range(3):
            policy = make_policy(f"openpi://{server.place}", 0)
            play_episode(policy)
            policy.close()
            policy.close()
        deadline = time.monotonic() + 300

        while server.open and time.monotonic() < deadline:
            time.sleep(0.01)

        assert (server.connections, server.open) == (3, 0)
