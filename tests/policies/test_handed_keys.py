"""Servers and models that send their client's key back: it is neither kept nor shown."""

from __future__ import annotations

import base64
import contextlib
import html
import json
import re
import sqlite3
import struct
from string import Template
from urllib.parse import quote

import msgpack
import pytest
from attackers import answering, frame, shake_hands, wait_for_end
from planning_fakes import fake_vlm, model_options

from roboirg.core import handed_keys
from roboirg.core.errors import InvalidValueError, PolicyServerError
from roboirg.core.plain_text import printable
from roboirg.policies import make_policy
from roboirg.policies.vlm.model_content import ChatTurn
from roboirg.policies.vlm.models import ModelQuery
from roboirg.policies.vlm.models.reply_store import REPLIES_FILE, ReplySettings, use_replies
from roboirg.policies.vlm.vlm_query import VLMQuery
from roboirg.records.episode_log import EpisodeLog
from roboirg.runs.episode_errors import describe_error
from roboirg.util.proxies import proxy_of

KEY = 'k7-"X/+secret\\of~ours'
VARIABLE = "KEY_OF_A_TEST"
ENCODED = [base64.b64encode(f"{before}{KEY}".encode()).decode() for before in ("", "u:", "me:")]
SPELLINGS_OF_KEY = [
    KEY,
    quote(KEY, safe=""),
    quote(KEY, safe="").lower(),
    json.dumps(KEY)[1:-1],
    json.dumps(KEY)[1:-1].replace("/", "\\/"),
    "".join(f"\\u{ord(letter):04X}" for letter in KEY),
    html.escape(KEY),
    repr(KEY.encode())[2:-1],
    *ENCODED,
    base64.urlsafe_b64encode(KEY.encode()).decode(),
    f"{ENCODED[0][:8]}\n{ENCODED[0][8:]}",
]


@pytest.fixture(autouse=True)
def key(monkeypatch):
    monkeypatch.setattr(handed_keys, "_spellings", set())
    monkeypatch.setenv(VARIABLE, KEY)


@pytest.mark.parametrize("spelling", SPELLINGS_OF_KEY)
def test_a_key_is_masked_in_all_its_encodings(spelling):
    """Such as URL encoding, JSON or HTML escapes, and Base64 with a user's name before it."""
    handed_keys.remember_key(KEY)
    cleaned = printable(f"Error: no key {spelling} here")
    # What stands before a key in Base64 may stay.
    assert re.fullmatch(r"Error: no key (\w{0,5})\*{20,} here", cleaned)


def test_a_key_remembered_with_bearer_is_masked_also_without_it():
    handed_keys.remember_key(f"Bearer {KEY}")
    assert KEY not in printable(f"401: {KEY}")
    assert printable("Bearer") == "Bearer"


@pytest.mark.parametrize("letters", ["\\", "s", "\\s", "sk-", "&amp;", "%73", "=\n"])
def test_a_long_text_full_of_almost_keys_is_searched_in_linear_time(letters):
    """With a quadratic search this would not end; nothing in it is a key."""
    handed_keys.remember_key("\\" * 20)
    handed_keys.remember_key("sk-" * 20)

    text = f"{letters * 19}x" * 5_000

    assert len(printable(text)) >= len(text)


def test_a_key_too_short_to_be_a_secret_masks_nothing():
    """*none* is no key, and a word that texts need."""
    handed_keys.remember_key("none")
    assert printable("none of the cubes") == "none of the cubes"


def recorded_of(message):
    """Return all that a record keeps of a policy server whose first message is that one: cause and
    details of an error, metadata, and version.

    The client has handed its key over as it connected. `message` is a frame of WebSocket.
    """

    def answer(peer):
        shake_hands(peer)
        peer.sendall(message)
        wait_for_end(peer)

    recorded = ""
    with answering(answer) as place:
        policy = make_policy(f"openpi://{place}?api_key_env={VARIABLE}", 0)
        try:
            policy.reset("Do it.", {})
        except PolicyServerError as error:
            described = describe_error("policy", error)
            recorded = f"{described.cause} {described.details}"
        recorded += f"{policy.metadata} {policy.version}"
        policy.close()
    return recorded


@pytest.mark.parametrize(
    "message",
    [
        # A server describes itself in its first message.
        frame(msgpack.packb({"version": KEY, "seen": {"Authorization": [f"Api-Key {KEY}"]}})),
        # A text (opcode 1) in place of metadata is an error of the server.
        frame(f"Traceback …\nValueError: {'x' * 280}{KEY}".encode(), 1),
        # A close (opcode 8) has a code, 1008 for a policy that is violated, and a reason.
        frame(struct.pack(">H", 1008) + f"no {KEY}".encode(), 8),
    ],
    ids=["metadata", "an error", "the reason of a close"],
)
def test_a_key_that_a_policy_server_repeats_is_masked_in_records(message):
    r"""A server repeats the client's key, `k7-"X/+secret\of~ours`, in its metadata or its error.

    An error is cut to 300 characters, here in the middle of the key: also then neither the key's
    beginning nor its end may be recorded.
    """
    recorded = recorded_of(message)

    assert "****" in recorded
    assert 'k7-"X/' not in recorded
    assert "f~ours" not in recorded


def test_a_key_in_the_reply_of_a_model_is_masked_when_shown_and_stored(tmp_path):
    """A model may repeat the key that the client sent in its header. The reply is shown to the
    policy and stored in a file; both have a star for each letter of the key.
    """
    query = ModelQuery("system", (ChatTurn("user", ("words",)),))
    with fake_vlm([f"my key is {KEY}"]) as server:
        vlm = VLMQuery(model_options(server, api_key_env=VARIABLE), Template("$why"))
        with use_replies(ReplySettings(tmp_path), "a"):
            shown = vlm.ask(query, str)

    with contextlib.closing(sqlite3.connect(tmp_path / REPLIES_FILE)) as database:
        (stored,) = database.execute("SELECT text FROM replies").fetchone()

    assert shown == stored == f"my key is {'*' * len(KEY)}"


def test_a_key_that_a_library_prints_is_masked_in_the_log(tmp_path):
    """A library may print straight into the file of a log, so that the file holds the key; when
    the log is closed, a star stands for each letter.
    """
    handed_keys.remember_key(KEY)
    with EpisodeLog(tmp_path / "log.txt") as log:
        log.path.write_text(f"closed: {KEY}\n")
    assert (tmp_path / "log.txt").read_text() == f"closed: {'*' * len(KEY)}\n"


def test_the_password_of_a_proxy_is_masked_in_plain_and_base64_text(monkeypatch):
    """The proxy's URL has the password `pass!word`, in which `!` is written as %21.

    Masked are the password and what a client sends to the proxy, `me:pass!word` in Base64; a star
    stands for each character.
    """
    monkeypatch.delenv("NO_PROXY", raising=False)
    monkeypatch.delenv("no_proxy", raising=False)
    monkeypatch.setenv("HTTPS_PROXY", "http://me:pass%21word@proxy.example:3128")
    monkeypatch.setenv("https_proxy", "http://me:pass%21word@proxy.example:3128")
    proxy_of("https://models.example/v1")

    sent = base64.b64encode(b"me:pass!word").decode()

    assert printable(f"407 pass!word Basic {sent}") == f"407 {'*' * 9} Basic {'*' * len(sent)}"


@pytest.mark.parametrize(
    "spec",
    [
        "vlm-listener:openai?model=x&base_url=http://me:{key}@host/v1",
        "vlm-listener:openai?model=x&api_key={key}",
        "openpi://{key}@host:8000",
        "openpi://host:8000?token={key}",
    ],
)
def test_a_policy_name_that_contains_a_key_is_refused_without_printing_it(spec):
    """Names of policies are printed and recorded, so keys belong into environment variables."""
    with pytest.raises(InvalidValueError, match="holds a key or password") as caught:
        make_policy(spec.format(key="hunter2hunter2"), 0)
    assert "hunter2" not in str(caught.value)
