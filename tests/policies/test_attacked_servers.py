"""Clients that idle, flood or come from foreign pages are refused or left; the server lives."""

import contextlib
import struct
import threading
from types import SimpleNamespace

import pytest
from attackers import opening, read_all, serving
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
    """A client without the key sends 1 GiB. The server (a process of its own) stays healthy and
    grows by at most 300 MiB, so it has not kept what came.

    It answers 401 (unauthorized). As this client does not stop to listen, the connection may be cut
    before the answer has arrived, so that nothing is read.
    """
    with serving("openpi", "--api-key-env", "KEY", KEY="sesame") as server:
        connection = server.connect(opening())

        def send_one_gib():
            with contextlib.suppress(OSError):  # the connection is cut
                for _ in range(1024):
                    connection.sendall(bytes(1 << 20))

        sender = threading.Thread(target=send_one_gib)
        sender.start()
        answer = read_all(connection)
        connection.close()
        sender.join()

        assert answer == b"" or answer.startswith(b"HTTP/1.1 401 ")
        assert server.grown_mib() <= 300
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
    """The command opens a server and waits for a signal to end it. The server is replaced by one
    that returns at once, and signals are not listened for. The command fails, and the error names
    the address.
    """
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
    """The longest message is a whole video: that of the benchmark has up to 1,187 observations,
    each with the fields that the protocol sends (`fields`) and pictures of 256 x 256 pixels.

    The limit is to hold that, with room for at most 30 % more: what is above it cannot be right.
    """
    observation = moment(0, size=256, sensors=True)
    one_observation = len(pack({name: [observation[name]] for name in fields}))
    longest_video = 1187 * one_observation

    limit = protocols_by_scheme()[scheme].service.max_request_bytes

    assert longest_video < limit < 1.3 * longest_video


def test_a_message_above_64_mib_is_refused_from_its_header(server_without_key):
    """A client announces a message of 64 MiB and one byte, and sends nothing of it.

    The server closes the connection with code 1009, which means *too big*, has reserved no memory
    for the message, and stays healthy.
    """
    # The last frame of a message, binary (0x82); masked, its length in 8 bytes (0xFF); the mask.
    header = struct.pack("!BBQ", 0x82, 0xFF, 64 * 2**20 + 1) + bytes(4)

    with server_without_key.connect(opening()) as connection:
        assert connection.recv(65536).startswith(b"HTTP/1.1 101 ")  # a WebSocket from here on
        connection.sendall(header)
        answer = read_all(connection)

    assert struct.pack("!H", 1009) in answer
    assert server_without_key.grown_mib() <= 300
    assert server_without_key.is_healthy()
