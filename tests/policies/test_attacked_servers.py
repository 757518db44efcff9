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


def status_of_request(server, host, headers=""):
    """Return the HTTP status with which a server answers the first request of a client."""
    with server.connect(opening(host, headers)) as raw:
        return int(raw.recv(65536).split()[1])


@pytest.mark.parametrize(
    "host", ["localhost:9", "192.0.2.7", "[::1]:8000", "robot-lab:8000"],
    ids=["through a tunnel", "address", "address of version 6", "name of the machine"],
)  # fmt: skip
def test_requests_to_a_server_by_a_name_of_its_own_are_welcome(server_without_key, host):
    """ROBOIRG_HOST_NAMES has the name of the machine. Status 101 begins a connection."""
    assert status_of_request(server_without_key, host) == 101


@pytest.mark.parametrize("host", ["evil.example:8000", "127.0.0.1:x", ""])
def test_requests_to_a_server_by_a_name_of_another_site_are_refused(server_without_key, host):
    """A page of another site may let its own name lead to this machine."""
    assert status_of_request(server_without_key, host) == 403


@pytest.mark.parametrize(
    ("origin", "status"),
    [("http://SERVER", 101), ("http://evil.example", 403), ("https://SERVER", 403)],
    ids=["its own page", "page of another site", "its own page in another scheme"],
)
def test_requests_from_web_pages_of_other_sites_are_refused(server_without_key, origin, status):
    """A browser names the site of the page as the origin of a request."""
    host = f"127.0.0.1:{server_without_key.port}"
    header = f"Origin: {origin.replace('SERVER', host)}\r\n"

    assert status_of_request(server_without_key, host, header) == status


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


@pytest.mark.parametrize(
    ("scheme", "fields"),
    [
        ("mme-vla", ("front_rgb", "joint_positions", "gripper")),
        ("challenge", [name for name in moment(0, sensors=True) if name != "instruction"]),
    ],
)
def test_the_largest_message_allowed_fits_the_longest_video_and_not_much_more(scheme, fields):
    """The longest video has 1,187 moments, with the fields that the protocol carries."""
    step = moment(0, size=256, sensors=True)
    bytes_of_ten = len(pack({name: [step[name]] * 10 for name in fields}))
    longest = 1187 * bytes_of_ten / 10

    allowed = protocols_by_scheme()[scheme].service.max_request_bytes

    assert longest < allowed < 1.3 * longest


def test_a_message_above_64_mib_is_refused_from_its_header(server_without_key):
    """Close code 1009 means that a message is too big."""
    header = struct.pack("!BBQ", 0x82, 0xFF, (64 << 20) + 1) + b"\0\0\0\0"
    with server_without_key.connect(opening()) as raw:
        assert raw.recv(65536).startswith(b"HTTP/1.1 101 ")
        raw.sendall(header)
        assert struct.pack("!H", 1009) in read_all(raw)

    assert server_without_key.grown_mib() <= MAX_MIB
    assert server_without_key.is_healthy()
