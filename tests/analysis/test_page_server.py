"""The page over real sockets: ranges, refusals, Ctrl-C."""

from __future__ import annotations

import http.client
import os
import re
import signal
import socket
import subprocess
import sys
import threading

import pytest
from made_records import make_record
from page_text import store

from roboirg.analysis.page.page_server import run_server
from roboirg.runs.plan.plan_maker import make_plan

pytestmark = pytest.mark.usefixtures("patient_sockets")

FILM_BYTES = bytes(range(256)) * 1000


PLAN = make_plan(("listener",), tasks="PickXtimes", settings="explicit", episodes="2")


@pytest.fixture
def run_with_a_film_and_a_link(tmp_path):
    """The folder of a run. A link in it leads to the file `secret` next to the folder."""
    folder = tmp_path / "run"
    (folder / "videos").mkdir(parents=True)
    (folder / "videos" / "a b.mp4").write_bytes(FILM_BYTES)
    (tmp_path / "secret").write_text("secret")
    (folder / "link").symlink_to(tmp_path / "secret")
    store(folder, [make_record(PLAN.jobs()[0], "success", steps=9)])
    return folder


@pytest.fixture
def server(run_with_a_film_and_a_link):
    with run_server(run_with_a_film_and_a_link) as serving:
        thread = threading.Thread(target=serving.serve_forever)
        thread.start()
        yield serving
        serving.shutdown()
        thread.join()


def response_and_body(port, path, method="GET", **headers):
    """Request a path of the server at a port, and return its answer and the content of that."""
    connection = http.client.HTTPConnection("127.0.0.1", port)
    connection.request(method, path, headers=headers)
    response = connection.getresponse()
    body = response.read()
    connection.close()
    return response, body


def test_a_video_is_served_whole_or_in_parts(server):
    """A browser asks for a range of bytes to seek; status 206 is a part."""
    whole, whole_body = response_and_body(server.port, "/videos/a%20b.mp4")
    part, part_body = response_and_body(server.port, "/videos/a%20b.mp4", Range="bytes=100-")

    assert (whole.status, whole_body) == (200, FILM_BYTES)
    assert whole.headers["Accept-Ranges"] == "bytes"
    assert (part.status, part_body) == (206, FILM_BYTES[100:])
    assert part.headers["Content-Type"] == "video/mp4"


@pytest.mark.parametrize("method", ["POST", "PUT", "DELETE"])
def test_a_request_that_would_write_is_refused(server, method):
    response, _ = response_and_body(server.port, "/", method)

    assert response.status == http.client.METHOD_NOT_ALLOWED


@pytest.mark.parametrize(
    "path",
    [
        "/../secret", "/%2e%2e/secret", "/videos/../../secret", "/videos/%2e%2e/%2e%2e/secret",
        "//etc/passwd", "/link", "/..%2fsecret", "/videos", "/nothing", "/%00", "/" + "a" * 5000,
    ],
)  # fmt: skip
def test_no_path_or_link_leads_out_of_the_folder_that_is_served(server, path):
    """Next to the folder lies a file `secret`, to which a link inside leads."""
    # A raw socket: clients would tidy up the path.
    with socket.create_connection(("127.0.0.1", server.port)) as raw:
        host = f"127.0.0.1:{server.port}"
        raw.sendall(f"GET {path} HTTP/1.1\r\nHost: {host}\r\nConnection: close\r\n\r\n".encode())
        answer = b"".join(iter(lambda: raw.recv(65536), b""))
    assert answer.startswith(b"HTTP/1.1 404 ")
    assert b"secret" not in answer
    assert b"root:" not in answer


def test_report_serve_prints_its_address_serves_the_page_and_ends_with_ctrl_c(
    run_with_a_film_and_a_link, wait_s
):
    """The command is started as a process; the address that it prints is opened.

    Ctrl-C (SIGINT) ends it with exit code 0.
    """
    pytest.importorskip("jinja2")
    folder = str(run_with_a_film_and_a_link)
    command = [sys.executable, "-m", "roboirg", "report", folder, "--serve"]
    environment = {**os.environ, "PYTHONUNBUFFERED": "1"}  # so that the address comes at once

    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True, env=environment) as process:
        printed = process.stdout.readline()
        port = re.match(r"http://127\.0\.0\.1:(\d+)/report.html ", printed)[1]
        _, page = response_and_body(int(port), "/report.html")
        process.send_signal(signal.SIGINT)
        exit_code = process.wait(timeout=wait_s)

    assert "<title>run – RoboIRGBench</title>" in page.decode()
    assert exit_code == 0
