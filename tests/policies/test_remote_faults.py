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

MALFORMED_REPLIES = [
    ("Traceback …\nValueError: the weights melted\n", "error: ValueError: the weights melted."),
    ("", "error: an empty text"),
    (b"\xc1\xff\x00", "something other than a message: the bytes are not a msgpack"),
    (b"", "something other than a message"),
    (pack([1, 2]), "the message is of type list, not a map"),
    (pack({b"x": 2}), "key b.x. that is not a text"),
    (pack({1: 2}), "int is not allowed"),
    ({"action": np.zeros((20, 8))}, "without 'actions'; it holds 'action'"),
    ({}, "it holds nothing"),
    ({"actions": np.zeros((20, 7))}, r"shape \(n, 8\) with n >= 1, got shape \(20, 7\)"),
    ({"actions": np.zeros((0, 8))}, r"got shape \(0, 8\)"),
    ({"actions": np.full((20, 8), np.nan)}, "value 0 of row 0: expected a finite number, got nan"),
    ({"actions": "left"}, "array of 8 real numbers, got str"),
    ({"actions": {"__numpy__": "AAAA", "dtype": "<f8"}}, "dialect .keys '__numpy__', 'dtype'."),
    ({"actions": None}, "got NoneType"),
    ({"actions": np.zeros((200_000, 8))}, "more than 1 MiB; option max_reply_mib"),
]
PROTOCOLS = {
    "openpi": WireServer,
    "mme-vla": MmeVlaServer,
    "challenge": ChallengeServer,
}


def play_episode(policy, *, steps=1):
    policy.reset(INSTRUCTION, video(2))
    return [policy.act(moment(2 + n, history=(moment(2 + n),) * n)) for n in range(steps)]


def messages_before_inference(protocol):
    """Messages of an episode before the first request for actions."""
    return {"openpi": 0, "mme-vla": 2}.get(protocol, 1)


@pytest.mark.parametrize(
    ("protocol", "reply", "words"),
    [("openpi", *fault) for fault in MALFORMED_REPLIES]
    + [
        (protocol, *fault)
        for protocol in ("mme-vla", "challenge")
        for fault in MALFORMED_REPLIES[::4]
    ],
)
def test_a_malformed_reply_is_reported_and_the_next_episode_works(protocol, reply, words):
    """`reply` takes the place of the server's answer to the first request for actions."""
    faults = [None] * messages_before_inference(protocol) + [reply]
    with PROTOCOLS[protocol](faults=faults) as server:
        with client_of(server, protocol, "?max_reply_mib=1") as policy:
            with pytest.raises(PolicyReplyError, match=words) as caught:
                play_episode(policy)
            assert server.place in str(caught.value)
        with client_of(server, protocol) as following:
            assert len(play_episode(following)) == 1


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
    with WireServer() as server, client_of(server, "openpi") as policy:
        server.metadata = {"status": "error", "message": "The checkpoint is missing."}
        with pytest.raises(PolicyReplyError, match="with an error: The checkpoint is missing"):
            play_episode(policy)


def test_a_server_that_takes_smaller_messages_only_is_not_taken_for_one_that_sends_larger_ones():
    """Its close code 1009 is also the one for replies above max_reply_mib."""
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
    with (
        PROTOCOLS[protocol](faults=[{"reset_finished": False}]) as server,
        client_of(server, protocol) as policy,
    ):
        with pytest.raises(PolicyReplyError, match="did not confirm 'reset'"):
            play_episode(policy)
        play_episode(policy)


@pytest.mark.parametrize("protocol", ["openpi", "mme-vla"])
def test_a_late_reply_is_a_timeout_and_not_taken_for_the_next_one(protocol):
    """The server takes five seconds, the client waits for two."""
    with (
        PROTOCOLS[protocol](faults=[None] * messages_before_inference(protocol) + [5.0]) as server,
        client_of(server, protocol, "?timeout=2") as policy,
    ):
        start = time.monotonic()
        with pytest.raises(PolicyTimeoutError, match="within 2 s"):
            play_episode(policy)
        assert time.monotonic() - start < 300  # and not for ever

        time.sleep(3)
        # The late answer must not become the next one's.
        following = make_policy(f"{protocol}://{server.place}", 0)
        first = play_episode(following)[0]
        following.close()

        assert np.array_equal(first, _played_in_time(policy)[0])


def _played_in_time(policy):
    """Return an episode's rows; with two seconds for a reply a busy machine may be late itself."""
    for _ in range(20):
        with contextlib.suppress(PolicyTimeoutError):
            return play_episode(policy)
    raise AssertionError("the server is always late")


@pytest.mark.parametrize("protocol", ["openpi", "mme-vla", "challenge"])
def test_a_server_that_dies_ends_its_episode_and_the_next_reset_connects_again(protocol):
    """The server ends the connection at the first request for actions."""
    with (
        PROTOCOLS[protocol](
            faults=[None] * messages_before_inference(protocol) + ["die"]
        ) as server,
        client_of(server, protocol) as policy,
    ):
        with pytest.raises(PolicyConnectionError, match="ended the connection"):
            play_episode(policy)
        with pytest.raises(PolicyConnectionError, match=r"call reset\(\)"):
            policy.act(moment(0, history=()))
        assert len(play_episode(policy, steps=2)) == 2


@pytest.mark.parametrize(
    ("sent", "options", "words"),
    [
        (b"", "connect=2&timeout=9", "did not send its metadata within 2 s"),
        (frame(pack({})), "timeout=0.5", r"did not take in a message within 0\.5 s"),
    ],
)
def test_a_server_that_stops_sending_or_reading_is_given_up_after_the_timeout(sent, options, words):
    over = threading.Event()

    def stall(peer):
        peer.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
        shake_hands(peer)
        peer.sendall(sent)
        over.wait(600)

    def play(policy):
        policy.reset(INSTRUCTION, {})
        policy.act(moment(0, size=2048))  # more than the kernel's buffers take

    with answering(stall) as place:
        start = time.monotonic()
        with pytest.raises(PolicyTimeoutError, match=words):
            play(make_policy(f"openpi://{place}?{options}", 0))
        assert time.monotonic() - start < 300
        over.set()


def test_a_second_reply_to_one_request_is_an_error():
    """Otherwise each later request would get the reply to the one before it."""
    said_twice = threading.Event()

    class Twice(MmeVlaServer):
        async def _converse(self, websocket):
            self.messages.append(await websocket.recv())
            for _ in range(2):
                await websocket.send(pack({"reset_finished": True, "add_buffer_finished": True}))
            said_twice.set()
            await super()._converse(websocket)

    with Twice() as server, client_of(server, "mme-vla") as policy:
        policy.reset(INSTRUCTION, video(0))
        assert said_twice.wait(300)
        time.sleep(3)  # until the surplus has come
        with pytest.raises(PolicyReplyError, match="without a request"):
            policy.act(moment(0, history=()))


def test_a_client_waits_for_a_server_that_starts_late_and_finds_it_after_a_restart():
    port = 20_000 + os.getpid() % 10_000  # below those that the kernel gives away
    policy = make_policy(f"mme-vla://127.0.0.1:{port}?connect=300", 0)
    server = MmeVlaServer(port=port)
    timer = threading.Timer(0.5, server.__enter__)
    timer.start()
    play_episode(policy)
    timer.join()
    server.__exit__()

    with pytest.raises(PolicyConnectionError):
        policy.act(moment(3, history=(moment(3),)))
    # It was stopped, and another one starts at the same port.
    with MmeVlaServer(port=port) as again:
        assert play_episode(policy)[0][0, :2].tolist() == [3, 2]
        assert again.connections == 1

    policy.close()


def test_an_absent_server_is_reported_in_one_sentence():
    policy = make_policy("openpi://127.0.0.1:9?connect=0.2", 0)
    with pytest.raises(
        PolicyConnectionError,
        match=r"^Policy server openpi://127\.0\.0\.1:9 cannot be reached "
        r"\((nothing listens there|Timeout)",
    ):
        policy.reset(INSTRUCTION, {})


def test_closing_a_policy_closes_its_connection():
    """Three policies are closed, each of them twice."""
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
