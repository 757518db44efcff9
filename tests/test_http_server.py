"""The HTTP servers over real sockets: clients that disconnect, limits of bodies, loopback only."""

import contextlib
import http.client
import socket
import struct
import threading
import time
from contextlib import contextmanager

import pytest

from roboirg.apps.real.pages.score_server import ScoreServer
from roboirg.apps.real.study.study_plan import make_study, write_study
from roboirg.core.errors import InvalidValueError
from roboirg.evaluation.analysis.page.page_server import PageServer
from roboirg.policies.policy_server import open_server
from roboirg.util.web.connection_table import ConnectionLimits
from roboirg.util.web.http_server import LoopbackRequestHandler, LoopbackServer

VIDEO_BYTES = 64 << 20
"""Larger than what the sockets buffer, so that the server is still sending at the hang-up."""


class Forgetful:
    """A policy that is never asked."""

    def __init__(self, seed=0):
        pass

    def reset(self, instruction, demonstration):
        pass

    def act(self, observation):
        return []


def page_server(folder):
    with (folder / "video.mp4").open("wb") as file:
        file.truncate(VIDEO_BYTES)
    return PageServer(folder, lambda: "<p>page</p>"), "GET /video.mp4", "/"


def score_server(folder):
    plan = make_study(
        ("a",), tasks=("PutInBox",), settings=("explicit",), trials=1, demonstrations=0
    )
    write_study(plan, folder)
    server = ScoreServer(plan, folder, "ann")
    return server, f"GET /?token={server.token}", f"/?token={server.token}"


def policy_server(_folder):
    server = open_server(f"{__name__}:Forgetful", "challenge+http").listening
    return server, "GET /metadata", "/healthz"


SERVERS = [page_server, score_server, policy_server]


@contextmanager
def running(server):
    thread = threading.Thread(target=server.serve_forever)
    thread.start()
    try:
        yield server.server_address[1]
    finally:
        server.shutdown()
        thread.join()
        server.server_close()


def get(port, path, **headers):
    connection = http.client.HTTPConnection("127.0.0.1", port, timeout=600)
    connection.request("GET", path, headers=headers)
    response = connection.getresponse()
    body = response.read()
    connection.close()
    return response, body


def hang_up(port, request, *, reset, receive=0):
    """Send a request and disconnect; a reset makes the server's next read or write fail."""
    raw = socket.create_connection(("127.0.0.1", port), timeout=600)
    raw.sendall(request)
    if receive:
        raw.recv(receive)
    if reset:
        raw.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
    raw.close()


def request_threads():
    return {one for one in threading.enumerate() if "process_request_thread" in one.name}


@pytest.mark.parametrize("reset", [False, True])
@pytest.mark.parametrize("make", SERVERS)
def test_a_client_that_disconnects_prints_nothing(make, reset, tmp_path, capfd):
    server, long_request, path = make(tmp_path)
    others = request_threads()
    with running(server) as port:
        host = f"Host: 127.0.0.1:{port}\r\n"
        for request, receive in (
            (b"", 0),
            (b"GET", 0),
            (b"GET / HTTP/1.1\r\nHost: loc", 0),
            (f"POST /score HTTP/1.1\r\n{host}Content-Length: 60000\r\n\r\nchoice=".encode(), 0),
            (f"POST /infer HTTP/1.1\r\n{host}Content-Length: 60000\r\n\r\nx".encode(), 0),
            (f"{long_request} HTTP/1.1\r\n{host}\r\n".encode(), 0),
            (f"{long_request} HTTP/1.1\r\n{host}\r\n".encode(), 10),
            (f"{long_request} HTTP/1.1\r\n{host}\r\n".encode() * 50, 0),
        ):
            hang_up(port, request, reset=reset, receive=receive)
        assert get(port, path)[0].status == 200
        deadline = time.monotonic() + 600
        while request_threads() - others and time.monotonic() < deadline:
            time.sleep(0.01)
        assert not request_threads() - others
    assert capfd.readouterr() == ("", "")


@pytest.mark.parametrize("make", SERVERS)
def test_an_error_of_the_server_prints_its_traceback(make, tmp_path, capfd, monkeypatch):
    server, _, path = make(tmp_path)

    def fail(self):
        raise RuntimeError("a bug")

    monkeypatch.setattr(server.RequestHandlerClass, "do_GET", fail)
    with running(server) as port, pytest.raises(http.client.RemoteDisconnected):
        get(port, path)
    assert "RuntimeError: a bug" in capfd.readouterr().err


@pytest.mark.parametrize(
    ("headers", "status"),
    [
        ("Content-Length: 9999999999", 413),
        (f"Content-Length: {'9' * 17}", 413),
        ("Content-Length: -1", 400),
        ("Content-Length: 1e3", 400),
        ("Content-Length: \xb2", 400),
        (f"Content-Length: {'9' * 5000}", 400),
        ("Content-Length: 5\r\nContent-Length: 6", 400),
        ("Transfer-Encoding: chunked", 411),
        ("\r\n".join(f"X-{n}: {'x' * 1000}" for n in range(90)), 431),
    ],
)
@pytest.mark.parametrize("make", [score_server, policy_server])
def test_bodies_and_heads_have_limits(make, headers, status, tmp_path, capfd):
    server, _, path = make(tmp_path)
    with running(server) as port:
        with socket.create_connection(("127.0.0.1", port), timeout=600) as raw:
            address = "/infer" if make is policy_server else "/score"
            head = f"POST {address} HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\n{headers}"
            raw.sendall(f"{head}\r\n\r\n".encode("latin-1"))
            answer = b"".join(iter(lambda: raw.recv(65536), b""))
        assert answer.startswith(f"HTTP/1.1 {status} ".encode())
        assert get(port, path)[0].status == 200
    assert capfd.readouterr().err == ""


@pytest.mark.parametrize("make", [page_server, score_server])
def test_pages_are_for_this_machine_only(make, tmp_path):
    server, _, path = make(tmp_path)
    with running(server) as port:
        for host, origin, status in (
            (f"localhost:{port}", None, 200),
            (f"127.0.0.1:{port}", f"http://127.0.0.1:{port}", 200),
            (f"127.0.0.1:{port}", f"http://localhost:{port}", 403),
            (f"127.0.0.1:{port}", "null", 403),
            (f"evil.example:{port}", None, 403),
            ("127.0.0.1", None, 403),
            (f"127.0.0.1:{port}", "http://evil.example", 403),
            (f"127.0.0.1:{port}", f"https://127.0.0.1:{port}", 403),
        ):
            headers = {"Host": host} | ({} if origin is None else {"Origin": origin})
            response, _ = get(port, path, **headers)
            assert response.status == status, headers
            assert response.headers["X-Content-Type-Options"] == "nosniff"
            assert response.headers["Server"].strip() == "roboirg"


def test_a_port_in_use_is_an_error():
    with LoopbackServer(0, LoopbackRequestHandler) as server:
        for port in (server.port, 70_000, -1):
            with pytest.raises(InvalidValueError, match=f"Port {port} is not available"):
                LoopbackServer(port, LoopbackRequestHandler)


@pytest.mark.parametrize("make", SERVERS)
def test_half_a_request_is_not_waited_for(make, tmp_path, capfd):
    server, long_request, path = make(tmp_path)
    others = request_threads()
    server.connections.limits = ConnectionLimits(request_s=0.5, body_s=0.5, idle_s=0.5)
    with running(server) as port:
        host = f"Host: 127.0.0.1:{port}\r\n"
        halves = (
            "",
            "GET",
            f"GET {path} HTTP/1.1\r\nHost: 127",
            f"GET {path} HTTP/1.1\r\n{host}",
            f"POST /score HTTP/1.1\r\n{host}Content-Length: 60000\r\n\r\nchoice=",
            f"POST /reset HTTP/1.1\r\n{host}Content-Length: 60000\r\n\r\nx",
            f"GET {path} HTTP/1.1\r\n{host}\r\n",
        )
        with contextlib.ExitStack() as opened:
            waiting = []
            for request in halves:
                raw = socket.create_connection(("127.0.0.1", port), timeout=600)
                opened.enter_context(raw).sendall(request.encode())
                waiting.append(raw)
            for raw in waiting:
                while raw.recv(65536):
                    pass
        # A client that does not take in what it asked for.
        with socket.create_connection(("127.0.0.1", port), timeout=600) as raw:
            raw.sendall(f"{long_request} HTTP/1.1\r\n{host}\r\n".encode() * 50)
            deadline = time.monotonic() + 600
            while request_threads() - others and time.monotonic() < deadline:
                time.sleep(0.01)
            assert not request_threads() - others
        server.connections.limits = ConnectionLimits()
        assert get(port, path)[0].status == 200
    assert capfd.readouterr() == ("", "")


@pytest.mark.slow
@pytest.mark.parametrize("make", SERVERS)
def test_idle_connections_keep_no_one_out(make, tmp_path, capfd):
    server, _, path = make(tmp_path)
    with running(server) as port, contextlib.ExitStack() as idle:
        before = threading.active_count()
        for number in range(300):
            raw = socket.create_connection(("127.0.0.1", port), timeout=600)
            idle.enter_context(raw)
            raw.sendall(b"GET / HTTP/1.1\r\nHost" if number % 2 else b"")
        assert get(port, path)[0].status == 200
        limits = server.connections.limits
        # Threads take a moment to end; those that are over the limit would stay for request_s.
        end = time.monotonic() + limits.request_s / 2
        while threading.active_count() - before > limits.connections + 5:
            assert time.monotonic() < end, threading.active_count()
            time.sleep(0.05)
    assert capfd.readouterr() == ("", "")
