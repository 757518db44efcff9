"""Clients that idle, flood or come from foreign pages are refused or left; the server lives."""

import contextlib
import struct
import threading
from types import SimpleNamespace

import pytest
from attackers import MAX_MIB, opening, read_all, serving
from typer.testing import CliRunner
from wire_episode import moment

from roboirg.main import app
from roboirg.policies import policy_server
from roboirg.policies.policy_server import PolicyServer
from roboirg.policies.remote.message_codec import pack
from roboirg.policies.remote.protocols import protocols_by_scheme
from roboirg.policies.remote.websocket_server import ServerOptions


@pytest.fixture(scope="module")
def server_without_key():
    with serving("openpi", ROBOIRG_HOST_NAMES="Robot-Lab") as server:
        yield server


def test_a_client_without_the_key_cannot_fill_the_memory_of_the_server():
    """It sends 1 GiB; the server answers 401 or cuts the connection, and lives."""
    with serving("openpi", "--api-key-env", "KEY", KEY="sesame") as server:
        raw = server.connect(opening())

        def send():
            with contextlib.suppress(OSError):
                for _ in range(1024):
                    raw.sendall(b"\0" * (1 << 20))

        sender = threading.Thread(target=send)
        sender.start()
        answer = read_all(raw)
        raw.close()
        sender.join()

        # A client waits for the answer before it sends more; of one that does not, the connection
        # is cut.
        assert answer.startswith(b"HTTP/1.1 401 ") or not answer
        assert server.grown_mib() <= MAX_MIB
        assert server.is_healthy()


def test_requests_from_web_pages_of_other_sites_are_refused_with_403(server_without_key):
    """Rows are host, more headers, and whether the request is welcome."""
    port = server_without_key.port
    for host, headers, welcome in (
        ("localhost:9", "", True),  # through a tunnel
        ("192.0.2.7", "", True),
        ("[::1]:8000", "", True),
        ("robot-lab:8000", "", True),
        (f"127.0.0.1:{port}", f"Origin: http://127.0.0.1:{port}\r\n", True),
        (f"127.0.0.1:{port}", "Origin: http://evil.example\r\n", False),
        (f"127.0.0.1:{port}", f"Origin: https://127.0.0.1:{port}\r\n", False),
        (f"evil.example:{port}", "", False),
        ("127.0.0.1:x", "", False),
        ("", "", False),
    ):
        with server_without_key.connect(opening(host, headers)) as raw:
            status = int(raw.recv(65536).split()[1])
        assert (status == 403) is not welcome, (host, headers, status)


def test_a_connection_that_sends_nothing_is_closed_after_the_timeout():
    with serving("challenge", "--timeout-s", "2") as server:
        with server.connect(opening()) as raw:
            read_all(raw)  # ends
        assert server.is_healthy()


def test_the_command_serve_fails_if_its_server_stops_by_itself(monkeypatch):
    stopped = SimpleNamespace(serve_forever=lambda: None)
    monkeypatch.setattr(
        policy_server, "open_server", lambda *_, **__: PolicyServer(stopped, "openpi://here:1")
    )
    monkeypatch.setattr("signal.signal", lambda *_: None)

    result = CliRunner().invoke(app, ["serve", "random"])

    assert result.exit_code != 0
    assert "openpi://here:1 has stopped by itself" in str(result.exception)


def test_the_key_of_a_server_is_not_in_the_text_of_its_options():
    assert "sesame" not in repr(ServerOptions(key="sesame"))


@pytest.mark.parametrize("scheme", ["challenge", "mme-vla"])
def test_the_largest_message_allowed_fits_the_longest_video_and_not_much_more(scheme):
    """The longest video has 1,187 moments; at most 30 % more is accepted."""
    # All of the longest video with the fields that the protocol can carry, as its client packs.
    step = moment(0, size=256, sensors=scheme == "challenge")
    if scheme == "mme-vla":
        step = {name: step[name] for name in ("front_rgb", "joint_positions", "gripper")}
    lists = {name: [value] * 10 for name, value in step.items() if name != "instruction"}
    longest = 1187 * len(pack(lists)) / 10

    assert longest < protocols_by_scheme()[scheme].service.max_request_bytes < 1.3 * longest


def test_a_message_above_64_mib_is_refused_from_its_header(server_without_key):
    """Close code 1009 means that a message is too big."""
    header = struct.pack("!BBQ", 0x82, 0xFF, (64 << 20) + 1) + b"\0\0\0\0"
    with server_without_key.connect(opening()) as raw:
        assert raw.recv(65536).startswith(b"HTTP/1.1 101 ")
        raw.sendall(header)
        assert struct.pack("!H", 1009) in read_all(raw)

    assert server_without_key.grown_mib() <= MAX_MIB
    assert server_without_key.is_healthy()
