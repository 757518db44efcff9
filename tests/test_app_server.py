"""The HTTP servers over real sockets: what they refuse, who hangs up, errors of ours."""

import http.client
import os
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
    (folder / "video.mp4").touch()
    os.truncate(folder / "video.mp4", VIDEO_BYTES)
    (folder / "page").write_text("a page")
    return run_server(folder)


def score_server(folder):
    plan = make_study(
        ("a",), tasks=("PutInBox",), settings=("explicit",), trials=1, demonstrations=0
    )
    write_study(plan, folder)
    return ScoreServer(plan, folder, "ann")


@contextmanager
def port_of_running(server):
    thread = threading.Thread(target=server.serve_forever)
    thread.start()
    try:
        yield server.port
    finally:
        server.shutdown()
        thread.join()
        server.server_close()


def response_to(server, path, **headers):
    connection = http.client.HTTPConnection("127.0.0.1", server.port, timeout=600)
    if isinstance(server, ScoreServer):
        headers["Cookie"] = f"{server.cookie}={server.key}"
    connection.request("GET", path, headers=headers)
    response = connection.getresponse()
    response.read()
    connection.close()
    return response


def socket_after(port, request):
    raw = socket.create_connection(("127.0.0.1", port), timeout=600)
    raw.sendall(request.encode("latin-1"))
    return raw


@pytest.mark.parametrize(
    "request_text",
    [
        "GET / HTTP/1.1\r\nHost: loc",
        "POST /infer HTTP/1.1\r\nHost: 127.0.0.1\r\nContent-Length: 60000\r\n\r\nx",
        "GET /video.mp4 HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n",
    ],
    ids=["in the headers", "in its body", "in the response"],
)
def test_a_client_that_hangs_up_makes_the_server_print_nothing_and_it_goes_on(
    request_text, tmp_path, capfd
):
    """A raw socket sends a request that is cut off in its headers or its body, or asks for a file
    of 64 MiB and reads ten bytes of it. Then it is closed. The next request is answered, and
    nothing was printed."""
    server = page_server(tmp_path)
    with port_of_running(server) as port:
        raw = socket_after(port, request_text)
        if "video" in request_text:
            raw.recv(10)
        raw.close()

        assert response_to(server, "/page").status == 200
    assert capfd.readouterr() == ("", "")


@pytest.mark.parametrize(
    ("headers", "status"),
    [
        ("Content-Length: 99999999999", 413),
        ("Content-Length: -1", 400),
        ("Content-Length: 5\r\nContent-Length: 6", 400),
    ],
)
def test_a_request_with_a_wrong_or_huge_length_is_refused(headers, status, tmp_path, capfd):
    """The server takes small bodies. 413 is "too large" and 400 "wrong": a negative length, or two
    that differ. It goes on with the next request."""
    server = score_server(tmp_path)
    with port_of_running(server) as port:
        key = f"Cookie: {server.cookie}={server.key}\r\n"
        head = f"POST /score HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\n{key}{headers}\r\n\r\n"
        with socket_after(port, head) as raw:
            assert raw.recv(65536).startswith(f"HTTP/1.1 {status} ".encode())
        assert response_to(server, "/").status == 200
    assert capfd.readouterr().err == ""


@pytest.mark.parametrize(("make", "path"), [(page_server, "/page"), (score_server, "/")])
def test_requests_from_pages_of_other_sites_are_refused(make, path, tmp_path):
    """A browser gives the name it was asked for (Host) and the page that asks (Origin)."""
    server = make(tmp_path)
    with port_of_running(server) as port:
        for status, headers in (
            (200, {"Host": f"localhost:{port}"}),
            (200, {"Host": f"127.0.0.1:{port}", "Origin": f"http://127.0.0.1:{port}"}),
            (403, {"Host": f"127.0.0.1:{port}", "Origin": f"http://localhost:{port}"}),
            (403, {"Host": f"127.0.0.1:{port}", "Origin": "null"}),
            (403, {"Host": f"127.0.0.1:{port}", "Origin": "http://evil.example"}),
            (403, {"Host": f"evil.example:{port}"}),
            (403, {"Host": f"evil.example:{port}", "Origin": f"http://evil.example:{port}"}),
            (403, {"Host": "127.0.0.1.evil.example"}),
        ):
            response = response_to(server, path, **headers)

            assert response.status == status, headers
            assert response.headers["X-Content-Type-Options"] == "nosniff", headers


def test_a_client_that_hangs_up_before_its_body_is_not_logged_as_an_error(caplog):
    """The server has begun to read a body of 60,000 bytes, of which the client sends one and hangs
    up."""
    started = threading.Event()

    async def read(request):
        started.set()
        return PlainTextResponse(await read_body(request, 60_000))

    with port_of_running(AppServer(Starlette(routes=[Route("/", read, methods=["POST"])]))) as port:
        head = f"POST / HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\nContent-Length: 60000\r\n\r\nx"
        raw = socket_after(port, head)
        assert started.wait(60)
    raw.close()
    assert caplog.text == ""


def test_an_exception_in_the_servers_own_code_is_logged_with_its_traceback(caplog):
    def fail(request):
        raise RuntimeError("a bug")

    server = AppServer(Starlette(routes=[Route("/", fail)]))

    with port_of_running(server):
        assert response_to(server, "/").status == 500
        deadline = time.monotonic() + 60  # the log follows the response
        while "RuntimeError: a bug" not in caplog.text and time.monotonic() < deadline:
            time.sleep(0.05)

    assert "RuntimeError: a bug" in caplog.text


def test_a_port_in_use_or_out_of_range_is_refused(tmp_path):
    """A server has a port already; ports go from 0 to 65,535."""
    with run_server(tmp_path) as server:
        for port in (server.port, 70_000, -1):
            with pytest.raises(InvalidValueError, match=f"Cannot listen on 127.0.0.1:{port} "):
                run_server(tmp_path, port)


PROGRAM_WITH_A_SLOW_SERVER = """
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
def test_ctrl_c_ends_a_server_although_a_request_is_not_finished(request_line):
    """The program serves one request that sleeps for ten minutes, and one that waits for the rest
    of its body; it prints its port, and "waiting" once a request has come. At Ctrl-C it must
    leave at once, with exit code 130."""
    with subprocess.Popen(
        [sys.executable, "-c", PROGRAM_WITH_A_SLOW_SERVER],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    ) as process:
        port = int(process.stdout.readline())
        head = f"{request_line}\r\nHost: 127.0.0.1:{port}\r\n"
        body = "Content-Length: 9\r\n\r\nx" if "POST" in request_line else "\r\n"

        with socket_after(port, head + body):
            assert process.stdout.readline() == "waiting\n"
            process.send_signal(signal.SIGINT)
            assert process.wait(timeout=300) == 130

        assert process.stderr.read() == ""
