"""Serve over a websocket: metadata first, then a reply per message, errors as text.

Connections are coroutines of one thread; the policy has a thread of its own, so health checks are
answered while it computes.
"""

from __future__ import annotations

import asyncio
import contextlib
import http
import threading
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

from websockets.asyncio.server import ServerConnection, serve
from websockets.exceptions import ConnectionClosed

from roboirg.policies.remote.message_codec import pack
from roboirg.policies.remote.server_options import ServerOptions
from roboirg.policies.remote.service import Service
from roboirg.policies.remote.serving.answering_thread import AnsweringThread
from roboirg.util.web.listening import listen

if TYPE_CHECKING:
    from websockets.http11 import Request, Response

CLOSE_TIMEOUT_S = 2.0
_INTERNAL_ERROR = 1011


class WebsocketServer:
    """Listens from the start and answers while `serve_forever` runs.

    Args:
        service: answers messages.
        metadata: sent first on every connection.
        options: address, key and time limit.

    Attributes:
        socket: that listens.
    """

    def __init__(
        self, service: Service, metadata: Mapping[str, Any], options: ServerOptions
    ) -> None:
        self._service, self._metadata, self._options = service, pack(metadata), options
        self.socket = listen(options.host, options.port)
        self._policy = AnsweringThread()
        self._stopping = threading.Event()
        self._wake: Callable[[], None] = self._stopping.set

    def serve_forever(self) -> None:
        """Answer until `shutdown` is called by another thread."""
        asyncio.run(self._serve())

    def shutdown(self) -> None:
        """Stop."""
        self._stopping.set()
        self._wake()

    async def _serve(self) -> None:
        loop, stop = asyncio.get_running_loop(), asyncio.Event()

        def wake() -> None:
            with contextlib.suppress(RuntimeError):  # it has stopped
                loop.call_soon_threadsafe(stop.set)

        self._wake = wake
        if self._stopping.is_set():
            stop.set()
        async with serve(
            self._converse,
            sock=self.socket,
            compression=None,
            max_size=self._service.max_request_bytes,
            process_request=self._check_request,
            close_timeout=CLOSE_TIMEOUT_S,
            max_queue=1,  # clients wait for a reply before they send more
            ping_interval=None,  # a pong would wait behind a large message
        ):
            await stop.wait()
        self._policy.stop()

    def _check_request(self, connection: ServerConnection, request: Request) -> Response | None:
        """Return the response to a request that opens no connection."""
        headers = request.headers
        refusal = self._options.refusal(headers.get_all("Host"), headers.get_all("Origin"))
        if refusal is not None:
            return connection.respond(http.HTTPStatus.FORBIDDEN, f"{refusal}\n")
        if request.path == "/healthz":
            return connection.respond(http.HTTPStatus.OK, "OK\n")
        keys = headers.get_all("Authorization")
        if not self._options.is_authorized(keys[0] if len(keys) == 1 else None):
            return connection.respond(
                http.HTTPStatus.UNAUTHORIZED, "The key is missing or wrong.\n"
            )
        return None

    async def _converse(self, connection: ServerConnection) -> None:
        handle, timeout_s = self._service.connection(), self._options.timeout_s
        with contextlib.suppress(ConnectionClosed, TimeoutError):
            await connection.send(self._metadata)
            while True:
                async with asyncio.timeout(timeout_s):
                    data = await connection.recv()
                reply = await self._policy.answer(handle, data)
                del data  # may be large
                async with asyncio.timeout(timeout_s):
                    await connection.send(reply)
                if isinstance(reply, str):
                    await connection.close(_INTERNAL_ERROR, "Internal server error.")
                    return
