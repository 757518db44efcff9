"""Servers that flood, drip, stall or lie: a named error, in time and within memory."""

import gzip
import queue
import struct
import time

import msgpack
import pytest
from attackers import (
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


QUESTION = ModelQuery("", (ChatTurn("user", ("hello",)),))


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


# Name, behavior, options, error, part of the message.


@pytest.fixture(scope="module")
def good():
    """The address of a server that keeps the rules."""
    with WireServer() as server:
        yield f"openpi://{server.place}"


@pytest.fixture(scope="module")
def clients():
    """A process whose method `play` lets a client play at a bad server, and then, so that it is
    seen to live on, at a good one; it returns the first error, its message, and the process's
    growth in MiB."""
    with attacked() as found:
        yield found


@pytest.mark.parametrize(
    ("answer", "option", "kind", "words"),
    [
        (sends_instead_of_metadata(LARGE_MESSAGE), "", "PolicyReplyError", "max_reply_mib"),
        (sends_in_reply(MANY_AXES), "", "PolicyReplyError", "an array |u1 of shape"),
        (
            sends_in_reply(b"a\n" * (25 * MIB), opcode=1),  # a text, which is a traceback
            "&max_reply_mib=64",
            "PolicyReplyError",
            "error: a.",
        ),
        (
            sends_in_reply(ESCAPES.encode(), opcode=1),
            "",
            "PolicyReplyError",
            r"error: Error: \x1b[2J\x1b]0;",
        ),
        (
            sends_text(
                b"HTTP/1.1 302 Go\r\nLocation: ws://127.0.0.1:9/\r\nContent-Length: 0\r\n\r\n"
            ),
            "",
            "PolicyConnectionError",
            "follow",
        ),
    ],
    ids=["50 MiB in a message", "400,000 axes", "50 MiB of text", "terminal codes", "redirect"],
)
def test_a_hostile_policy_server_ends_in_a_named_error_without_filling_memory(
    answer, option, kind, words, clients, good
):
    """A server answers a client as the case says. The client must end with an error of this kind
    and words, which names the server and can be printed, and which does not keep the large message:
    its process may grow by 300 MiB at most, a few copies of 50 MiB."""
    with answering(answer) as place:
        url = f"openpi://{place}?connect=60&timeout=60{option}"
        error, message, grown_mib = clients.play(url, good)

    assert (error, message.isprintable()) == (kind, True)
    assert words in message
    assert place in message
    assert grown_mib <= 300


def test_a_policy_server_that_floods_with_pings_ends_in_a_named_error_in_time(clients, good):
    """The client has to answer each ping of the server. It has a second for a reply, and one to
    connect, for which a loaded machine may need longer: so it may be either that has failed."""
    with answering(floods_with_pings) as place:
        url = f"openpi://{place}?connect=1&timeout=1"
        error, message, grown_mib = clients.play(url, good)

    assert error in ("PolicyTimeoutError", "PolicyConnectionError")
    assert "within 1 s" in message or "tried for 1 s" in message
    assert grown_mib <= 300


def error_of_model(provider, answer):
    """Return the message of the error if a model's endpoint answers a question in this way."""
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
            model.answer(QUESTION)
    return str(caught.value)


@pytest.mark.parametrize("provider", ["openai", "google"])
def test_a_compressed_answer_of_a_model_endpoint_is_not_unpacked(provider):
    """A small compressed answer may be huge when unpacked, so clients ask for plain ones and take
    no other. Where the error names the type of the reply stands *None*, as it has no header
    Content-Type."""
    zipped = gzip.compress(b"{}")
    head = f"HTTP/1.1 200 OK\r\nContent-Encoding: gzip\r\nContent-Length: {len(zipped)}\r\n\r\n"

    message = error_of_model(provider, sends_text(head.encode() + zipped))

    assert "replied with something else, None that begins" in message
    assert message.isprintable()


def test_an_endless_answer_of_a_model_endpoint_ends_at_64_mib():
    """The server sends chunks of 64 KiB for ever; replies of models have a limit of 64 MiB."""
    message = error_of_model("openai", sends_endless_chunks)

    assert "the response has more than 64 MiB" in message


@pytest.mark.parametrize("provider", ["openai", "google"])
def test_an_error_of_a_model_endpoint_with_terminal_codes_can_be_printed(provider):
    r"""The text of status 400 is ``\x1b[2J``, which clears a screen that it is printed on."""
    answer = sends_text(b"HTTP/1.1 400 No\r\nContent-Length: 4\r\n\r\n\x1b[2J")

    message = error_of_model(provider, answer)

    assert "refused or failed" in message
    assert message.isprintable()


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (b"<html>\n<b>Log in</b>" + b"x" * 200, "text/html that begins '<html> <b>Log in</b>x"),
        (b'{"error": "no such model"}', 'text/html that begins \'{"error": "no such model"}\''),
    ],
)
def test_of_a_reply_that_is_no_answer_its_type_and_beginning_are_named(content, words):
    """The server replies with status 200 and the type text/html: a page to log in, or an error,
    either of which could be taken for an empty answer. The error has the type and the beginning of
    the content, but not all of the page: with the address it is shorter than 300 characters."""
    head = f"HTTP/1.1 200 OK\r\nContent-Type: text/html\r\nContent-Length: {len(content)}\r\n\r\n"

    with answering(sends_text(head.encode() + content)) as place:
        model = make_model(ModelOptions(provider="google", model="m", base_url=f"http://{place}"))
        with pytest.raises(UnknownCostError) as caught:
            model.answer(QUESTION)

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


def noting_when_it_ends(answer, ended):
    """Return a way to answer that puts True into a queue once the client has hung up."""

    def answer_until_hung_up(peer):
        try:
            answer(peer)
        finally:
            ended.put(True)

    return answer_until_hung_up


@pytest.mark.parametrize("answer", [sends_blanks_for_ever, sends_interim_answers_for_ever])
def test_what_reads_an_endless_answer_of_a_model_ends_after_the_time_limit(answer):
    """The server sends a byte or a header after another, for ever, until the client hangs up. Two
    questions run into the time limit of 1 s; then the client must hang up both times (else the
    queue stays empty): whatever read on would stay, with a connection, for each late answer."""
    ended = queue.Queue()

    with answering(noting_when_it_ends(answer, ended)) as place:
        model = make_model(ModelOptions(model="m", base_url=f"http://{place}", timeout_s=1))
        for _ in range(2):
            with pytest.raises(PolicyTimeoutError):
                model.answer(QUESTION)

        assert ended.get(timeout=PATIENCE)
        assert ended.get(timeout=PATIENCE)


def test_control_characters_of_a_server_are_printed_as_escapes():
    """Line breaks, accents and Chinese stay; codes that clear a screen or reverse text do not."""
    assert printable("naïve 你好 – ok\n\tend") == "naïve 你好 – ok\n\tend"
    assert printable(ESCAPES) == (r"Error: \x1b[2J\x1b]0;owned\x07 \x9b2J \u202e gpj.exe")
    assert printable("\ud800") == r"\ud800"
