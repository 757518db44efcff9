"""The HTTP side of the RoboMME challenge's interface."""

from __future__ import annotations

import http
import traceback
from collections.abc import Mapping
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import Any

from roboirg.policies.remote.http_connection import MSGPACK
from roboirg.policies.remote.message_codec import pack, unpack
from roboirg.policies.serving.service import Service
from roboirg.policies.serving.websocket_server import LARGEST_REQUEST, is_authorized

TEXT = "text/plain; charset=utf-8"
PATIENCE = 60.0
"""Seconds that a client may take for a piece of its request."""


class _Server(ThreadingHTTPServer):
    """Listens; every connection has a thread of its own.

    Args:
        place: host and port.
        service: answers.
        metadata: what ``/metadata`` gives.
        key: what clients have to know, if anything.
    """

    daemon_threads = True

    def __init__(
        self, place: tuple[str, int], service: Service, metadata: Mapping[str, Any], key: str | None
    ) -> None:
        super().__init__(place, _PolicyHandler)
        self.answer, self.metadata, self.key = service.connection(), metadata, key


def open_http(
    service: Service, metadata: Mapping[str, Any], host: str, port: int, key: str | None
) -> ThreadingHTTPServer:
    """A server that listens; it answers once `serve_forever` is called.

    Args:
        service: answers.
        metadata: what ``/metadata`` gives.
        host: to listen at.
        port: to listen at; 0 for any that is free.
        key: what clients have to know, if anything.

    Raises:
        OSError: the address is in use or is not this computer's.
    """
    return _Server((host, port), service, metadata, key)


class _PolicyHandler(BaseHTTPRequestHandler):
    """Answers one request after the other of a connection."""

    server: _Server
    protocol_version = "HTTP/1.1"
    timeout = PATIENCE
    # Head and body leave together; in two packets they would wait for each other.
    wbufsize = -1
    disable_nagle_algorithm = True

    def do_GET(self) -> None:
        if self.path == "/healthz":
            self._reply(http.HTTPStatus.OK, b"OK\n", TEXT)
        elif not is_authorized(self.server.key, self.headers.get("Authorization")):
            self._reply(http.HTTPStatus.UNAUTHORIZED, b"The key is missing or wrong.\n", TEXT)
        elif self.path == "/metadata":
            self._reply(http.HTTPStatus.OK, pack(self.server.metadata), MSGPACK)
        else:
            self._reply(http.HTTPStatus.NOT_FOUND, b"There is no such page.\n", TEXT)

    def do_POST(self) -> None:
        length = self.headers.get("Content-Length", "0")
        if not length.isdecimal() or int(length) > LARGEST_REQUEST:
            self.close_connection = True
            self._reply(http.HTTPStatus.REQUEST_ENTITY_TOO_LARGE, b"Too large.\n", TEXT)
            return
        body = self.rfile.read(int(length))
        if not is_authorized(self.server.key, self.headers.get("Authorization")):
            self._reply(http.HTTPStatus.UNAUTHORIZED, b"The key is missing or wrong.\n", TEXT)
        elif self.path not in ("/reset", "/infer"):
            self._reply(http.HTTPStatus.NOT_FOUND, b"There is no such page.\n", TEXT)
        elif self.path == "/infer" and not body:
            self._reply(http.HTTPStatus.BAD_REQUEST, b"The request is empty.\n", TEXT)
        else:
            self._answer(body)

    def _answer(self, body: bytes) -> None:
        try:
            request = {"reset": True} if self.path == "/reset" else unpack(body)
            reply = pack(self.server.answer(request))
        except Exception:  # noqa: BLE001 - the boundary: the policy's author wants to see all of it
            error = traceback.format_exc().encode()
            self._reply(http.HTTPStatus.INTERNAL_SERVER_ERROR, error, TEXT)
            return
        self._reply(http.HTTPStatus.OK, reply, MSGPACK)

    def _reply(self, status: int, body: bytes, kind: str) -> None:
        self.send_response(status)
        self.send_header("Content-Type", kind)
        self.send_header("Content-Length", str(len(body)))
        self.end_headers()
        self.wfile.write(body)

    def log_message(self, format: str, *args: object) -> None:  # noqa: A002
        """Keep quiet: a line for each request helps nobody."""
