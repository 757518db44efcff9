"""Peers that break the rules, on raw sockets, and the processes that they attack."""

import base64
import hashlib
import json
import os
import socket
import struct
import subprocess
import sys
import threading
from contextlib import contextmanager, suppress

PATIENCE = 300
"""Seconds; far more than anything here takes on a loaded machine."""
UPGRADE = (
    "Upgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Version: 13\r\n"
    "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n"
)

SERVE = (
    "import typer; from roboirg.cli.policy_commands import serve; app = typer.Typer(); "
    "app.command()(serve); app()"
)

CLIENT = """
import json, sys
from roboirg.policies import make_policy
from wire_episode import INSTRUCTION, moment, video

def peak():
    return int(open("/proc/self/status").read().split("VmHWM:")[1].split()[0]) // 1024

before = peak()
for line in sys.stdin:
    bad, good = line.split()
    found = ["no error", ""]
    try:
        policy = make_policy(bad, 0)
        policy.reset(INSTRUCTION, video(0))
        policy.act(moment(0, history=()))
    except Exception as error:
        found = [type(error).__name__, str(error)]
    finally:
        policy.close()
    took = peak() - before
    policy = make_policy(good, 0)
    policy.reset(INSTRUCTION, video(0))
    print(json.dumps([*found, took, len(policy.act(moment(0, history=())))]), flush=True)
    policy.close()
"""


def environment(**more):
    here = os.path.dirname(__file__)  # noqa: PTH120
    path = os.pathsep.join(filter(None, [here, os.environ.get("PYTHONPATH", "")]))
    return {**os.environ, "PYTHONPATH": path, "PYTHONUNBUFFERED": "1", **more}


class Served:
    """A policy behind ``roboirg serve`` in a process of its own."""

    def __init__(self, process, url):
        self.process = process
        self.url = url
        self.port = int(url.rsplit(":", 1)[1])
        self._first_peak = self.status("VmHWM")

    def status(self, name):
        with open(f"/proc/{self.process.pid}/status") as file:  # noqa: PTH123
            return int(file.read().split(f"{name}:")[1].split()[0])

    def grown_mib(self):
        """The most memory, MiB, that the process has taken since it began to serve."""
        return (self.status("VmHWM") - self._first_peak) // 1024

    def is_healthy(self):
        head = b"GET /healthz HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n"
        with self.connect(head) as raw:
            return read_all(raw).endswith(b"\r\n\r\nOK\n")

    def connect(self, data=b""):
        raw = socket.create_connection(("127.0.0.1", self.port), timeout=PATIENCE)
        raw.sendall(data)
        return raw


@contextmanager
def serving(protocol, *options, **variables):
    """Serve a policy in a process of its own."""
    with subprocess.Popen(
        [sys.executable, "-c", SERVE, "random", "--protocol", protocol, "--port", "0", *options],
        stdout=subprocess.PIPE, text=True, env=environment(**variables),
    ) as process:  # fmt: skip
        try:
            line = process.stdout.readline()
            yield Served(process, next(word for word in line.split() if "://" in word).rstrip(";"))
        finally:
            process.kill()


def opening(host="127.0.0.1", headers=""):
    """The first request of a client."""
    return f"GET / HTTP/1.1\r\nHost: {host}\r\n{UPGRADE}{headers}\r\n".encode()


def read_all(raw):
    """What a peer sends until it ends the connection, one way or the other."""
    found = b""
    with suppress(ConnectionError):
        while data := raw.recv(65536):
            found += data
    return found


@contextmanager
def answering(answer):
    """A server whose connections are handled by a function; yields ``host:port``."""
    listener = socket.create_server(("127.0.0.1", 0))

    def handle(peer):
        with peer, suppress(OSError):
            answer(peer)

    def accept():
        with suppress(OSError):
            while True:
                peer, _ = listener.accept()
                threading.Thread(target=handle, args=(peer,), daemon=True).start()

    thread = threading.Thread(target=accept, daemon=True)
    thread.start()
    try:
        yield f"127.0.0.1:{listener.getsockname()[1]}"
    finally:
        listener.shutdown(socket.SHUT_RDWR)
        listener.close()
        thread.join()


class Attacked:
    """Clients in a process of its own, which outlives all attacks."""

    def __init__(self, process):
        self.process = process

    def play(self, bad, good):
        """Play an episode at a bad server and then one at a good one.

        Returns the first one's error, its message, and the most memory, MiB, that the process has
        taken since it began.
        """
        impatient = threading.Timer(PATIENCE, self.process.kill)
        impatient.start()
        print(bad, good, file=self.process.stdin, flush=True)
        line = self.process.stdout.readline()
        impatient.cancel()
        assert line, f"the client has ended with {self.process.wait()}"
        *found, rows = json.loads(line)
        assert rows > 0
        return found


@contextmanager
def attacked():
    """Yield clients to be attacked; their errors are printed."""
    with subprocess.Popen(
        [sys.executable, "-c", CLIENT],
        stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, env=environment(),
    ) as process:  # fmt: skip
        try:
            yield Attacked(process)
        finally:
            process.kill()


def read_head(peer):
    head = b""
    while b"\r\n\r\n" not in head:
        data = peer.recv(65536)
        if not data:
            raise ConnectionError
        head += data
    return head.decode("latin-1")


def shake_hands(peer):
    head = read_head(peer)
    key = next(line.split(": ")[1] for line in head.split("\r\n") if "Sec-WebSocket-Key" in line)
    digest = hashlib.sha1((key + "258EAFA5-E914-47DA-95CA-C5AB0DC85B11").encode()).digest()  # noqa: S324
    peer.sendall(
        b"HTTP/1.1 101 Switching Protocols\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
        b"Sec-WebSocket-Accept: " + base64.b64encode(digest) + b"\r\n\r\n"
    )


def frame(data, opcode=2, *, final=True):
    head = bytes([opcode | (0x80 if final else 0)])
    if len(data) < 126:
        return head + bytes([len(data)]) + data
    return head + struct.pack(">BQ", 127, len(data)) + data


def wait_for_end(peer):
    """Keep a connection open until the client ends it."""
    while peer.recv(65536):
        pass
