"""Serve a policy over HTTP, as the RoboMME challenge does."""

from __future__ import annotations

import traceback
from collections.abc import Mapping
from http import HTTPStatus
from typing import Any

from roboirg.policies.remote.http_connection import MSGPACK
from roboirg.policies.remote.message_codec import pack, unpack
from roboirg.policies.serving.service import Service
from roboirg.policies.serving.websocket_server import LARGEST_REQUEST, is_authorized
from roboirg.util.http_server import HTTPServerBase, RequestHandler

CLIENT_TIMEOUT_S = 60.0
"""How long a client may take for a piece of its request."""


class _ChallengeHTTPServer(HTTPServerBase):
    """Answers with a service.

    Args:
        address: host and port.
        service: answers requests.
        metadata: response to ``/metadata``.
        key: that clients send, or None.
    """

    def __init__(
        self,
        address: tuple[str, int],
        service: Service,
        metadata: Mapping[str, Any],
        key: str | None,
    ) -> None:
        super().__init__(address, _ChallengeRequestHandler)
        self.answer, self.metadata, self.key = service.connection(), metadata, key


def open_http(
    service: Service, metadata: Mapping[str, Any], host: str, port: int, key: str | None
) -> HTTPServerBase:
    """Return a listening server; it answers once `serve_forever` is called.

    Args:
        service: answers requests.
        metadata: response to ``/metadata``.
        host: to listen at.
        port: to listen at; 0 for any free port.
        key: that clients send, or None.

    Raises:
        OSError: the address is in use or is not this computer's.
    """
    return _ChallengeHTTPServer((host, port), service, metadata, key)


class _ChallengeRequestHandler(RequestHandler):
    """Handle ``/healthz``, ``/metadata``, ``/reset`` and ``/infer``."""

    server: _ChallengeHTTPServer
    timeout = CLIENT_TIMEOUT_S

    def do_GET(self) -> None:  # noqa: N802 - name of the base class
        if self.path == "/healthz":
            self.send_text("OK\n")
        elif self._check_key():
            if self.path == "/metadata":
                self.send_bytes(pack(self.server.metadata), MSGPACK)
            else:
                self.send_refusal(HTTPStatus.NOT_FOUND, "There is no such page.")

    def do_POST(self) -> None:  # noqa: N802 - name of the base class
        body = self.read_body(LARGEST_REQUEST, message="Too large.")
        if body is None or not self._check_key():
            return
        if self.path not in ("/reset", "/infer"):
            self.send_refusal(HTTPStatus.NOT_FOUND, "There is no such page.")
        elif self.path == "/infer" and not body:
            self.send_refusal(HTTPStatus.BAD_REQUEST, "The request is empty.")
        else:
            self._answer(body)

    def _check_key(self) -> bool:
        """Return whether the client sent the key; refuse the request if not."""
        authorized = is_authorized(self.server.key, self.headers.get("Authorization"))
        if not authorized:
            self.send_refusal(HTTPStatus.UNAUTHORIZED, "The key is missing or wrong.")
        return authorized

    def _answer(self, body: bytes) -> None:
        try:
            request = {"reset": True} if self.path == "/reset" else unpack(body)
            reply = pack(self.server.answer(request))
        except Exception:  # noqa: BLE001 - the boundary: the policy's author needs the traceback
            self.send_text(traceback.format_exc(), status=HTTPStatus.INTERNAL_SERVER_ERROR)
            return
        self.send_bytes(reply, MSGPACK)
