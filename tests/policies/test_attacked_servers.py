"""Clients that idle, stall, drip, flood or come from foreign pages: other clients are served on."""

import contextlib
import struct
import threading
from functools import cache
from types import SimpleNamespace

import httpx
import pytest
from attackers import (
    MAX_MIB,
    opening,
    read_all,
    serving,
)
from typer.testing import CliRunner
from wire_episode import INSTRUCTION, moment, video
from wire_servers import unpack

from roboirg.core.errors import PolicyConnectionError
from roboirg.main import app
from roboirg.policies import make_policy, policy_server
from roboirg.policies.policy_server import PolicyServer, open_server
from roboirg.policies.remote.message_codec import pack
from roboirg.policies.remote.protocols import protocols_by_scheme
from roboirg.policies.remote.server_options import ServerOptions

GIB = 1 << 30
SCHEMES = [scheme for scheme, protocol in protocols_by_scheme().items() if protocol.service]
WEBSOCKETS = [scheme for scheme in SCHEMES if "http" not in scheme]
FAMILIES = ("openpi", "challenge+http")
"""One protocol on websockets and one on HTTP: others share the code that listens and reads."""
ALL_SCHEMES = [
    pytest.param(scheme, marks=[] if scheme in FAMILIES else pytest.mark.slow) for scheme in SCHEMES
]


@pytest.fixture(scope="module")
def shared():
    """Return a function that serves a protocol with options, once for all tests."""
    with contextlib.ExitStack() as stack:

        @cache
        def serve(scheme, *options, **variables):
            return stack.enter_context(serving(scheme, *options, **variables))

        yield serve


def locked(shared, scheme):
    return shared(scheme, "--api-key-env", "KEY", KEY="sesame")


def lenient(shared, scheme):
    return shared(scheme, ROBOIRG_HOST_NAMES="Robot-Lab")


def begin(url):
    policy = make_policy(url, 0)
    policy.reset(INSTRUCTION, video(1))
    assert len(policy.act(moment(0, history=()))) > 0
    return policy


def go_on(policy):
    assert len(policy.act(moment(1, history=(moment(1),)))) > 0


@pytest.mark.parametrize("scheme", ALL_SCHEMES)
def test_a_body_without_a_key_is_not_read(shared, scheme):
    server = locked(shared, scheme)
    data = b"\0" * (1 << 20)
    if "http" in scheme:
        head = f"POST /infer HTTP/1.1\r\nHost: 127.0.0.1\r\nContent-Length: {GIB}\r\n\r\n"
    else:
        head = opening(scheme).decode()
    raw = server.connect(head.encode())

    def send():
        with contextlib.suppress(OSError):
            for _ in range(1024):
                raw.sendall(data)

    sender = threading.Thread(target=send)
    sender.start()
    answer = read_all(raw)
    raw.close()
    sender.join()
    # A websocket's client waits for the answer before it sends more; of one that does not,
    # the connection is cut.
    assert answer.startswith(b"HTTP/1.1 401 ") or ("http" not in scheme and not answer)
    assert server.grown_mib() <= MAX_MIB
    assert server.is_healthy()


def test_a_body_is_asked_for_only_with_the_key(shared):
    server = locked(shared, "challenge+http")
    head = (
        "POST /infer HTTP/1.1\r\nHost: 127.0.0.1\r\nContent-Length: 1\r\nExpect: 100-continue\r\n"
    )
    with server.connect(f"{head}\r\n".encode()) as raw:
        assert raw.recv(65536).startswith(b"HTTP/1.1 401 ")
    with server.connect(f"{head}Authorization: Api-Key sesame\r\n\r\n".encode()) as raw:
        assert raw.recv(65536) == b"HTTP/1.1 100 Continue\r\n\r\n"


def test_metadata_need_no_key_over_http_as_the_challenges_client_sends_none(shared):
    server = locked(shared, "challenge+http")
    address = f"http://127.0.0.1:{server.port}"
    found = httpx.get(f"{address}/metadata", trust_env=False, timeout=300)
    assert unpack(found.content)["policy"] == "random"
    assert httpx.post(f"{address}/reset", trust_env=False, timeout=300).status_code == 401


@pytest.mark.parametrize("scheme", ALL_SCHEMES)
def test_pages_of_other_sites_are_refused(shared, scheme):
    server = lenient(shared, scheme)
    port = server.port
    for host, headers, welcome in (
        (f"127.0.0.1:{port}", "", True),
        ("localhost:9", "", True),  # through a tunnel
        ("192.0.2.7", "", True),
        ("[::1]:8000", "", True),
        ("robot-lab:8000", "", True),
        (f"127.0.0.1:{port}", f"Origin: http://127.0.0.1:{port}\r\n", True),
        (f"127.0.0.1:{port}", "Origin: http://evil.example\r\n", False),
        (f"127.0.0.1:{port}", "Origin: null\r\n", False),
        (f"127.0.0.1:{port}", f"Origin: https://127.0.0.1:{port}\r\n", False),
        (f"evil.example:{port}", "", False),
        (f"evil.example:{port}", f"Origin: http://evil.example:{port}\r\n", False),
        ("127.0.0.1.evil.example", "", False),
        ("127.0.0.1:x", "", False),
        ("", "", False),
    ):
        with server.connect(opening(scheme, host, headers)) as raw:
            status = int(raw.recv(65536).split()[1])
        assert (status == 403) is not welcome, (host, headers, status)


@pytest.mark.parametrize("scheme", WEBSOCKETS[:1])
def test_a_silent_connection_ends_and_the_others_play_on(scheme):
    with serving(scheme, "--timeout-s", "2") as server:
        with server.connect(opening(scheme)) as raw:
            read_all(raw)  # ends
        _play_on(server.url)
        assert server.is_healthy()


def _play_on(url):
    """Play; a busy machine may be silent itself for two seconds, which ends its connection."""
    for _ in range(20):
        with contextlib.suppress(PolicyConnectionError):
            policy = begin(url)
            go_on(policy)
            policy.close()
            return
    pytest.fail("the others cannot play on")


class Costly:
    """A policy whose making is counted."""

    made = 0

    def __init__(self, seed=0):
        type(self).made += 1

    def reset(self, instruction, demonstration):
        pass

    def act(self, observation):
        return [[0.0] * 8]


@pytest.mark.parametrize("scheme", WEBSOCKETS)
def test_connections_without_a_message_make_no_policy(scheme):
    server = open_server(f"{__name__}:Costly", scheme)
    Costly.made = 0
    thread = threading.Thread(target=server.listening.serve_forever)
    thread.start()
    policies = [make_policy(f"{server.url}?shared=yes", 0) for _ in range(3)]
    if scheme == "openpi":  # has no message to begin an episode
        for policy in policies:
            policy.reset(INSTRUCTION, video(0))
        assert Costly.made == 0
    policies[0].reset(INSTRUCTION, video(0))
    policies[0].act(moment(0, history=()))
    assert Costly.made == 1
    for policy in policies:
        policy.close()
    server.listening.shutdown()
    thread.join()


def test_a_server_that_stops_by_itself_is_an_error(monkeypatch):
    stopped = SimpleNamespace(serve_forever=lambda: None)
    monkeypatch.setattr(
        policy_server, "open_server", lambda *_, **__: PolicyServer(stopped, "openpi://here:1")
    )
    monkeypatch.setattr("signal.signal", lambda *_: None)
    result = CliRunner().invoke(app, ["serve", "random"])
    assert result.exit_code != 0
    assert "openpi://here:1 has stopped by itself" in str(result.exception)


def test_a_server_can_be_stopped_before_it_has_started():
    for scheme in WEBSOCKETS:
        server = open_server("random", scheme).listening
        server.shutdown()
        server.serve_forever()


def test_a_key_is_not_shown():
    assert "sesame" not in repr(ServerOptions(key="sesame"))


@pytest.mark.parametrize("scheme", ALL_SCHEMES)
def test_a_message_is_as_large_as_a_video_needs_and_no_larger(shared, scheme):
    service = protocols_by_scheme()[scheme].service
    if scheme == "openpi":  # shows no video
        assert service.max_request_bytes == 64 << 20
    else:
        # All of the longest video with the fields that the protocol can carry, as its client packs.
        step = moment(0, size=256, sensors="challenge" in scheme)
        if scheme == "mme-vla":
            step = {name: step[name] for name in ("front_rgb", "joint_positions", "gripper")}
        lists = {name: [value] * 10 for name, value in step.items() if name != "instruction"}
        longest = 1187 * len(pack(lists)) / 10
        assert longest < service.max_request_bytes < 1.3 * longest
    server = lenient(shared, scheme)
    size = service.max_request_bytes + 1
    if "http" in scheme:
        head = f"POST /infer HTTP/1.1\r\nHost: 127.0.0.1\r\nContent-Length: {size}\r\n\r\n"
        with server.connect(head.encode()) as raw:
            assert read_all(raw).startswith(b"HTTP/1.1 413 ")
    else:
        header = struct.pack("!BBQ", 0x82, 0xFF, size) + b"\0\0\0\0"
        with server.connect(opening(scheme)) as raw:
            assert raw.recv(65536).startswith(b"HTTP/1.1 101 ")
            raw.sendall(header)
            assert struct.pack("!H", 1009) in read_all(raw)
    assert server.grown_mib() <= MAX_MIB
    assert server.is_healthy()
