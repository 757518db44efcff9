"""Serve a policy over HTTP, as the RoboMME challenge does."""

from __future__ import annotations

import traceback
from collections.abc import Mapping
from http import HTTPStatus
from typing import Any

from roboirg.policies.remote.message_codec import MSGPACK, pack, unpack
from roboirg.policies.remote.server_options import ServerOptions
from roboirg.policies.remote.service import Service
from roboirg.util.web.http_server import HTTPServerBase, RequestHandler


class _ChallengeHTTPServer(HTTPServerBase):
    """Answers with a service.

    Args:
        service: answers requests.
        metadata: response to ``/metadata``.
        options: address, key and limits.
    """

    def __init__(
        self, service: Service, metadata: Mapping[str, Any], options: ServerOptions
    ) -> None:
        super().__init__((options.host, options.port), _ChallengeRequestHandler, options.limits)
        self.answer, self.metadata, self.options = service.connection(), metadata, options
        self.max_request_bytes = service.max_request_bytes


def open_http(
    service: Service, metadata: Mapping[str, Any], options: ServerOptions
) -> HTTPServerBase:
    """Return a listening server; it answers once `serve_forever` is called.

    Args:
        service: answers requests.
        metadata: response to ``/metadata``.
        options: address, key and limits.

    Raises:
        OSError: the address is in use or is not this computer's.
    """
    return _ChallengeHTTPServer(service, metadata, options)


class _ChallengeRequestHandler(RequestHandler):
    """Handle ``/healthz``, ``/metadata``, ``/reset`` and ``/infer``."""

    server: _ChallengeHTTPServer

    def do_GET(self) -> None:  # noqa: N802 - name of the base class
        """Answer without a key, as the challenge's clients send none with these requests."""
        if not self._check_origin():
            return
        if self.path == "/healthz":
            self.send_text("OK\n")
        elif self.path == "/metadata":
            self.send_bytes(pack(self.server.metadata), MSGPACK)
        else:
            self.send_refusal(HTTPStatus.NOT_FOUND, "There is no such page.")

    def do_POST(self) -> None:  # noqa: N802 - name of the base class
        """Answer a request that has the key; without it, the body is not read."""
        if not self._check_origin() or not self._check_key():
            return
        if self.path not in ("/reset", "/infer"):
            self.send_refusal(HTTPStatus.NOT_FOUND, "There is no such page.")
            return
        body = self.read_body(self.server.max_request_bytes, message="Too large.")
        if body is None:
            return
        if self.path == "/infer" and not body:
            self.send_refusal(HTTPStatus.BAD_REQUEST, "The request is empty.")
            return
        self.server.connections.prove(self.connection)
        self._answer(body)

    def _check_origin(self) -> bool:
        """Return whether no page of another site caused the request; refuse it if one did."""
        hosts, origins = self.headers.get_all("Host", []), self.headers.get_all("Origin", [])
        refusal = self.server.options.refusal(hosts, origins)
        if refusal is not None:
            self.send_refusal(HTTPStatus.FORBIDDEN, refusal)
        return refusal is None

    def _check_key(self) -> bool:
        """Return whether the client sent the key; refuse the request if not."""
        authorized = self.server.options.is_authorized(self.headers.get("Authorization"))
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
