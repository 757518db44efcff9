"""The websocket side: metadata first, then an answer for each message, errors as text."""

from __future__ import annotations

import contextlib
import hmac
import http
import traceback
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from websockets.exceptions import ConnectionClosed
from websockets.sync.server import ServerConnection, serve

from roboirg.policies.remote.endpoints import MIB
from roboirg.policies.remote.message_codec import pack, unpack
from roboirg.policies.serving.service import Service

if TYPE_CHECKING:
    from websockets.http11 import Request, Response
    from websockets.sync.server import Server

LARGEST_REQUEST = 1024 * MIB
"""Bytes: room for the longest video of both cameras in one message."""
_INTERNAL_ERROR = 1011


class _Connection(ServerConnection):
    """Reads large pieces: a request holds up to hundreds of megabytes of pictures."""

    # Room for still larger ones comes fresh from the system at every read, which costs more.
    recv_bufsize = 256 * 1024


def open_websocket(
    service: Service, metadata: Mapping[str, Any], host: str, port: int, key: str | None
) -> Server:
    """A server that listens; it answers once `serve_forever` is called.

    Args:
        service: answers.
        metadata: what a client is told first.
        host: to listen at.
        port: to listen at; 0 for any that is free.
        key: what clients have to know, if anything.

    Raises:
        OSError: the address is in use or is not this computer's.
    """

    def request(connection: ServerConnection, asked: Request) -> Response | None:
        if asked.path == "/healthz":
            return connection.respond(http.HTTPStatus.OK, "OK\n")
        if not is_authorized(key, asked.headers.get("Authorization")):
            return connection.respond(
                http.HTTPStatus.UNAUTHORIZED, "The key is missing or wrong.\n"
            )
        return None

    def converse(connection: ServerConnection) -> None:
        with contextlib.suppress(ConnectionClosed):
            connection.send(pack(metadata))
            answer = service.connection()
            for data in connection:
                try:
                    if isinstance(data, str):
                        raise TypeError("Messages are binary; a text came.")
                    reply = pack(answer(unpack(data)))
                except Exception:  # noqa: BLE001 - the boundary: the policy's author wants to see all of it
                    connection.send(traceback.format_exc())
                    connection.close(_INTERNAL_ERROR, "Internal server error.")
                    return
                connection.send(reply)

    return serve(
        converse,
        host,
        port,
        compression=None,
        max_size=LARGEST_REQUEST,
        process_request=request,
        ping_interval=None,
        create_connection=_Connection,
    )


def is_authorized(key: str | None, header: str | None) -> bool:
    """Return whether the header ``Authorization`` holds the key, or no key is needed."""
    if key is None:
        return True
    return hmac.compare_digest((header or "").encode(), f"Api-Key {key}".encode())
