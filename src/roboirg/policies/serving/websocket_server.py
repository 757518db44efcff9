"""Serve over a websocket: metadata first, then a reply per message, errors as text."""

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
"""Bytes; fits the longest video of both cameras in one message."""
_INTERNAL_ERROR = 1011


class _LargeReadConnection(ServerConnection):
    """Reads large pieces, as requests hold up to hundreds of megabytes of pictures."""

    # A still larger buffer is allocated by the system at every read, which costs more.
    recv_bufsize = 256 * 1024


def open_websocket(
    service: Service, metadata: Mapping[str, Any], host: str, port: int, key: str | None
) -> Server:
    """Return a server that listens; it answers once `serve_forever` is called.

    Args:
        service: answers messages.
        metadata: sent first on every connection.
        host: address to listen at.
        port: port to listen at; 0 for any free one.
        key: clients must send it; None admits all clients.

    Raises:
        OSError: the address is in use or not this computer's.
    """

    def check_request(connection: ServerConnection, request: Request) -> Response | None:
        if request.path == "/healthz":
            return connection.respond(http.HTTPStatus.OK, "OK\n")
        if not is_authorized(key, request.headers.get("Authorization")):
            return connection.respond(
                http.HTTPStatus.UNAUTHORIZED, "The key is missing or wrong.\n"
            )
        return None

    def converse(connection: ServerConnection) -> None:
        with contextlib.suppress(ConnectionClosed):
            connection.send(pack(metadata))
            handle = service.connection()
            for data in connection:
                try:
                    if isinstance(data, str):
                        raise TypeError("Messages must be binary, not text.")
                    reply = pack(handle(unpack(data)))
                except Exception:  # noqa: BLE001 - the boundary: the policy's author sees the traceback
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
        process_request=check_request,
        ping_interval=None,
        create_connection=_LargeReadConnection,
    )


def is_authorized(key: str | None, header: str | None) -> bool:
    """Return whether the header ``Authorization`` holds the key, or no key is needed."""
    if key is None:
        return True
    return hmac.compare_digest((header or "").encode(), f"Api-Key {key}".encode())
