"""The HTTP servers over real sockets: what they refuse, who hangs up, errors of ours."""

import http.client
import signal
import socket
import subprocess
import sys
import threading
import time
from contextlib import contextmanager

import pytest
from starlette.applications import Starlette
from starlette.responses import PlainTextResponse
from starlette.routing import Route

from roboirg.analysis.page.page_server import run_server
from roboirg.apps.real.pages.score_server import ScoreServer
from roboirg.apps.real.study.study_plan import make_study, write_study
from roboirg.core.errors import InvalidValueError
from roboirg.util.web.app_server import AppServer, read_body

VIDEO_BYTES = 64 << 20
"""Larger than what the sockets buffer, so that the server is still sending at the hang-up."""


def page_server(folder):
    with (folder / "video.mp4").open("wb") as file:
        file.truncate(VIDEO_BYTES)
    (folder / "page").write_text("a page")
    return run_server(folder)


def score_server(folder):
    plan = make_study(
        ("a",), tasks=("PutInBox",), settings=("explicit",), trials=1, demonstrations=0
    )
    write_study(plan, folder)
    return ScoreServer(plan, folder, "ann")


@contextmanager
def running(server):
    thread = threading.Thread(target=server.serve_forever)
    thread.start()
    try:
        yield server.port
    finally:
        server.shutdown()
        thread.join()
        server.server_close()


def get(server, path, **headers):
    connection = http.client.HTTPConnection("127.0.0.1", server.port, timeout=600)
    if isinstance(server, ScoreServer):
        headers["Cookie"] = f"{server.cookie}={server.key}"
    connection.request("GET", path, headers=headers)
    response = connection.getresponse()
    response.read()
    connection.close()
    return response


def send(port, request):
    raw = socket.create_connection(("127.0.0.1", port), timeout=600)
    raw.sendall(request.encode("latin-1"))
    return raw


def test_a_client_that_disconnects_prints_nothing(tmp_path, capfd):
    server = page_server(tmp_path)
    with running(server) as port:
        host = f"Host: 127.0.0.1:{port}\r\n"
        for request in (
            "GET / HTTP/1.1\r\nHost: loc",
            f"POST /infer HTTP/1.1\r\n{host}Content-Length: 60000\r\n\r\nx",
            f"GET /video.mp4 HTTP/1.1\r\n{host}\r\n",
        ):
            raw = send(port, request)
            if "video" in request:
                raw.recv(10)
            raw.close()
        assert get(server, "/page").status == 200
    assert capfd.readouterr() == ("", "")


@pytest.mark.parametrize(
    ("headers", "status"),
    [
        ("Content-Length: 99999999999", 413),
        ("Content-Length: -1", 400),
        ("Content-Length: 5\r\nContent-Length: 6", 400),
    ],
)
def test_what_is_no_request_or_too_large_is_refused(headers, status, tmp_path, capfd):
    server = score_server(tmp_path)
    with running(server) as port:
        key = f"Cookie: {server.cookie}={server.key}\r\n"
        head = f"POST /score HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\n{key}{headers}\r\n\r\n"
        with send(port, head) as raw:
            assert raw.recv(65536).startswith(f"HTTP/1.1 {status} ".encode())
        assert get(server, "/").status == 200
    assert capfd.readouterr().err == ""


@pytest.mark.parametrize(("make", "path"), [(page_server, "/page"), (score_server, "/")])
def test_pages_of_other_sites_are_refused(make, path, tmp_path):
    server = make(tmp_path)
    with running(server) as port:
        for host, origin, status in (
            (f"localhost:{port}", None, 200),
            (f"127.0.0.1:{port}", f"http://127.0.0.1:{port}", 200),
            (f"127.0.0.1:{port}", f"http://localhost:{port}", 403),
            (f"127.0.0.1:{port}", "null", 403),
            (f"127.0.0.1:{port}", "http://evil.example", 403),
            (f"evil.example:{port}", None, 403),
            (f"evil.example:{port}", f"http://evil.example:{port}", 403),
            ("127.0.0.1.evil.example", None, 403),
        ):
            headers = {"Host": host} | ({} if origin is None else {"Origin": origin})
            response = get(server, path, **headers)
            assert response.status == status, headers
            assert response.headers["X-Content-Type-Options"] == "nosniff"


def test_a_body_that_does_not_come_is_not_logged(caplog):
    started = threading.Event()

    async def read(request):
        started.set()
        return PlainTextResponse(await read_body(request, 60_000))

    with running(AppServer(Starlette(routes=[Route("/", read, methods=["POST"])]))) as port:
        head = f"POST / HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\nContent-Length: 60000\r\n\r\nx"
        raw = send(port, head)
        assert started.wait(60)
    raw.close()
    assert caplog.text == ""


def test_an_error_of_ours_logs_its_traceback(caplog):
    def fail(request):
        raise RuntimeError("a bug")

    server = AppServer(Starlette(routes=[Route("/", fail)]))

    with running(server):
        assert get(server, "/").status == 500
        deadline = time.monotonic() + 60  # the log follows the response
        while "RuntimeError: a bug" not in caplog.text and time.monotonic() < deadline:
            time.sleep(0.05)

    assert "RuntimeError: a bug" in caplog.text


def test_a_port_in_use_is_an_error(tmp_path):
    with run_server(tmp_path) as server:
        for port in (server.port, 70_000, -1):
            with pytest.raises(InvalidValueError, match=f"Cannot listen on 127.0.0.1:{port} "):
                run_server(tmp_path, port)


WAITING = """
import sys, time
from starlette.applications import Starlette
from starlette.routing import Route
from roboirg.util.web.app_server import AppServer, read_body

def wait(request):
    print("waiting", flush=True)
    time.sleep(600)

async def read(request):
    print("waiting", flush=True)
    await read_body(request, 9)

server = AppServer(Starlette(routes=[Route("/", wait), Route("/", read, methods=["POST"])]))
print(server.port, flush=True)
try:
    server.serve_forever()
except KeyboardInterrupt:
    sys.exit(130)
finally:
    server.server_close()
"""


@pytest.mark.parametrize("request_line", ["GET / HTTP/1.1", "POST / HTTP/1.1"])
def test_ctrl_c_does_not_wait_for_a_request(request_line):
    with subprocess.Popen(
        [sys.executable, "-c", WAITING], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    ) as process:
        port = int(process.stdout.readline())
        head = f"{request_line}\r\nHost: 127.0.0.1:{port}\r\n"
        body = "Content-Length: 9\r\n\r\nx" if "POST" in request_line else "\r\n"

        with send(port, head + body):
            assert process.stdout.readline() == "waiting\n"
            process.send_signal(signal.SIGINT)
            assert process.wait(timeout=300) == 130

        assert process.stderr.read() == ""
