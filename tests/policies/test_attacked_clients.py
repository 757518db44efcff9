"""Servers that flood, drip, stall or lie: a named error, in time and within memory."""

import gzip
import struct
import threading
import time

import msgpack
import pytest
from attackers import (
    MAX_MIB,
    PATIENCE,
    answering,
    attacked,
    frame,
    read_head,
    shake_hands,
    wait_for_end,
)
from wire_servers import WireServer

from roboirg.core.errors import PolicyServerError, PolicyTimeoutError, UnknownCostError
from roboirg.core.plain_text import printable
from roboirg.policies.vlm.model_content import ChatTurn
from roboirg.policies.vlm.models import ModelOptions, ModelQuery, make_model

MIB = 1 << 20
LARGE_MESSAGE = b"\x81\xa1a\xc6" + struct.pack(">I", 50 * MIB) + b"\x80" * (50 * MIB)
MANY_AXES = msgpack.packb(
    {
        "actions": {
            b"__ndarray__": True, b"data": b"x", b"dtype": "|u1",
            b"shape": [2**60 + 1] * 400_000,
        }
    }
)  # fmt: skip
ESCAPES = "Error: \x1b[2J\x1b]0;owned\x07 \x9b2J \u202e gpj.exe"


def sends_instead_of_metadata(data, opcode=2):
    """Shake hands and send one frame instead of the metadata."""

    def answer(peer):
        shake_hands(peer)
        peer.sendall(frame(data, opcode))
        wait_for_end(peer)

    return answer


def sends_in_reply(data, opcode=2):
    """Send the metadata, and one frame in reply to the first message."""

    def answer(peer):
        shake_hands(peer)
        peer.sendall(frame(b"\x80"))
        peer.recv(1)
        peer.sendall(frame(data, opcode))
        wait_for_end(peer)

    return answer


def floods_with_pings(peer):
    shake_hands(peer)
    peer.sendall(frame(b"\x80"))
    while True:  # and read none of the answers
        peer.sendall(frame(b"x" * 125, 9) * 100)


def sends_endless_chunks(peer):
    read_head(peer)
    peer.sendall(b"HTTP/1.1 200 OK\r\nTransfer-Encoding: chunked\r\n\r\n")
    while True:
        peer.sendall(b"10000\r\n" + b"\x80" * 65536 + b"\r\n")


def sends_text(text):
    def answer(peer):
        read_head(peer)
        peer.sendall(text)
        wait_for_end(peer)

    return answer


TIMEOUT = "PolicyTimeoutError"
REPLY = "PolicyReplyError"
CONNECTION = "PolicyConnectionError"
LARGE = "&max_reply_mib=64"
QUICK = "?connect=1&timeout=1"
PATIENT = "?connect=60&timeout=60"
# Name, behavior, options, error, part of the message.
ATTACKS = [
    ("large", sends_instead_of_metadata(LARGE_MESSAGE), PATIENT, REPLY, "max_reply_mib"),
    ("axes", sends_in_reply(MANY_AXES), PATIENT, REPLY, "an array |u1 of shape"),
    ("traceback", sends_in_reply(b"a\n" * (25 * MIB), 1), PATIENT + LARGE, REPLY, "error: a."),
    (
        "escapes",
        sends_in_reply(ESCAPES.encode(), 1),
        PATIENT,
        REPLY,
        r"error: Error: \x1b[2J\x1b]0;",
    ),
    ("pings", floods_with_pings, QUICK, TIMEOUT, "within 1 s"),
    (
        "redirect",
        sends_text(b"HTTP/1.1 302 Go\r\nLocation: ws://127.0.0.1:9/\r\nContent-Length: 0\r\n\r\n"),
        PATIENT,
        CONNECTION,
        "follow",
    ),
]


@pytest.fixture(scope="module")
def good():
    with WireServer() as server:
        yield f"openpi://{server.place}"


@pytest.fixture(scope="module")
def clients():
    with attacked() as found:
        yield found


@pytest.mark.parametrize("attack", ATTACKS, ids=[attack[0] for attack in ATTACKS])
def test_a_hostile_policy_server_ends_in_a_named_error_without_filling_memory(
    attack, clients, good
):
    """Attacks: huge messages, huge arrays, terminal escapes, floods of pings, a redirect.

    A row of ATTACKS has a name, how the server answers, the client's options, and the kind and
    words of the error that is expected. The error names the server and can be printed, and the
    client's memory grows by MAX_MIB at most. QUICK clients wait a second only.
    """
    _, answer, options, kind, words = attack
    with answering(answer) as place:
        error, message, mib = clients.play(f"openpi://{place}{options}", good)

    if options == QUICK:  # on a loaded machine even the connection may take too long
        assert error in (TIMEOUT, CONNECTION)
        assert words in message or "tried for 1 s" in message
    else:
        assert error == kind
        assert words in message
    assert place in message
    assert message.isprintable()
    assert mib <= MAX_MIB


ZIPPED = gzip.compress(b"{}")
COMPRESSED_ANSWER = sends_text(
    b"HTTP/1.1 200 OK\r\nContent-Encoding: gzip\r\nContent-Length: %d\r\n\r\n" % len(ZIPPED)
    + ZIPPED
)
ANSWER_WITH_ESCAPE = sends_text(b"HTTP/1.1 400 No\r\nContent-Length: 4\r\n\r\n\x1b[2J")


@pytest.mark.parametrize(
    ("provider", "answer", "words"),
    [
        (
            "openai",
            COMPRESSED_ANSWER,
            "replied with something else, None that begins",
        ),
        (
            "google",
            COMPRESSED_ANSWER,
            "replied with something else, None that begins",
        ),
        ("openai", sends_endless_chunks, "the response has more than 64 MiB"),
        ("openai", ANSWER_WITH_ESCAPE, "refused or failed"),
        ("google", ANSWER_WITH_ESCAPE, "refused or failed"),
    ],
    ids=["openai-gzip", "google-gzip", "chunks", "openai-escapes", "google-escapes"],
)
def test_a_hostile_model_endpoint_ends_in_a_named_error(provider, answer, words):
    """Attacks: a compressed answer, an endless one, and terminal escapes in an error."""
    with answering(answer) as place:
        options = ModelOptions(
            provider=provider,
            model="m",
            base_url=f"http://{place}",
            retries=0,
            patience_s=0,
            timeout_s=200,
        )
        model = make_model(options)
        with pytest.raises(PolicyServerError) as caught:
            model.answer(ModelQuery("", (ChatTurn("user", ("hello",)),)))
    assert words in str(caught.value)
    assert str(caught.value).isprintable()


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (b"<html>\n<b>Log in</b>" + b"x" * 200, "text/html that begins '<html> <b>Log in</b>x"),
        (b'{"error": "no such model"}', 'text/html that begins \'{"error": "no such model"}\''),
    ],
)
def test_of_a_reply_that_is_no_answer_its_type_and_beginning_are_named(content, words):
    """A page to log in, and an error with status 200, which would be read as an empty answer."""
    head = f"HTTP/1.1 200 OK\r\nContent-Type: text/html\r\nContent-Length: {len(content)}\r\n\r\n"
    with answering(sends_text(head.encode() + content)) as place:
        model = make_model(ModelOptions(provider="google", model="m", base_url=f"http://{place}"))
        with pytest.raises(UnknownCostError) as caught:
            model.answer(ModelQuery("", (ChatTurn("user", ("hello",)),)))

    assert words in str(caught.value)
    assert len(str(caught.value)) < 300


def sends_blanks_for_ever(peer):
    read_head(peer)
    peer.sendall(b"HTTP/1.1 200 OK\r\nContent-Length: 999999999\r\n\r\n")
    drip(peer, b" ")


def sends_interim_answers_for_ever(peer):
    read_head(peer)
    drip(peer, b"HTTP/1.1 100 Continue\r\n\r\n")


def drip(peer, piece):
    while True:  # until the client closes the connection
        peer.sendall(piece)
        time.sleep(0.05)


@pytest.mark.parametrize("answer", [sends_blanks_for_ever, sends_interim_answers_for_ever])
def test_what_reads_an_endless_answer_of_a_model_ends_after_the_time_limit(answer):
    """A thread that reads on would stay with a connection for each answer that came too late.

    Two questions run into the time limit of 1 s. Of the threads that began since, those that read
    an answer (`_fetch`) end soon; one that has ended already is no longer listed.
    """
    before = set(threading.enumerate())
    with answering(answer) as place:
        options = ModelOptions(model="m", base_url=f"http://{place}", timeout_s=1)
        model = make_model(options)
        for _ in range(2):
            with pytest.raises(PolicyTimeoutError):
                model.answer(ModelQuery("", (ChatTurn("user", ("hello",)),)))
        for thread in set(threading.enumerate()) - before:
            if "_fetch" in thread.name:
                thread.join(PATIENCE)
                assert not thread.is_alive()


def test_control_characters_of_a_server_are_printed_as_escapes():
    """Line breaks, accents and Chinese stay; codes that clear a screen or reverse text do not."""
    assert printable("naïve 你好 – ok\n\tend") == "naïve 你好 – ok\n\tend"
    assert printable(ESCAPES) == (r"Error: \x1b[2J\x1b]0;owned\x07 \x9b2J \u202e gpj.exe")
    assert printable("\ud800") == r"\ud800"
