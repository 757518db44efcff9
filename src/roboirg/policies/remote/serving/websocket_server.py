"""Serve over a websocket: metadata first, then a reply per message, errors as text.

Connections are coroutines of one thread, so idle ones cost little; the policy has a thread of its
own, and health checks are answered while it computes.
"""

from __future__ import annotations

import asyncio
import contextlib
import http
import socket
import threading
import traceback
from collections.abc import Callable, Mapping
from concurrent.futures import ThreadPoolExecutor
from typing import TYPE_CHECKING, Any

from websockets.asyncio.server import ServerConnection, serve
from websockets.exceptions import ConnectionClosed, InvalidMessage

from roboirg.policies.remote.message_codec import pack, unpack
from roboirg.policies.remote.server_options import ServerOptions
from roboirg.policies.remote.service import Handler, Service
from roboirg.util.web.connection_table import OUT_OF_FILES, ConnectionTable

if TYPE_CHECKING:
    from websockets.asyncio.server import Server
    from websockets.http11 import Request, Response
    from websockets.server import ServerProtocol

BACKLOG = 128
CLOSE_TIMEOUT_S = 2.0
_INTERNAL_ERROR = 1011
_BAD_REQUEST = b"HTTP/1.1 400 Bad Request\r\nContent-Length: 0\r\nConnection: close\r\n\r\n"
_CONTROL_FRAME = 131
"""Size of the largest, bytes."""
_SWEEPS = 4
"""Per shortest time limit, which may be exceeded by the time between two sweeps."""
_MAX_PAUSE_S = 1.0


class _LimitedConnection(ServerConnection):
    """A connection that stands in its server's table."""

    def __init__(self, protocol: ServerProtocol, server: Server, **options: Any) -> None:  # noqa: ANN401
        self.table: ConnectionTable[_LimitedConnection] = options.pop("table")
        self._receiving = self._refused = False
        super().__init__(protocol, server, **options)

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        super().connection_made(transport)
        if not self.table.add(self):
            self.transport.abort()

    def connection_lost(self, exc: Exception | None) -> None:
        self.table.discard(self)
        super().connection_lost(exc)

    def data_received(self, data: bytes) -> None:
        # A message has to be complete some time after it began; a ping begins none.
        if self._receiving and len(data) > _CONTROL_FRAME:
            self._receiving = False
            self.table.expect(self, self.table.limits.body_s)
        super().data_received(data)

    def send_data(self) -> None:
        # The library ends a connection that sends no valid request without a word.
        if isinstance(self.protocol.handshake_exc, InvalidMessage) and not self._refused:
            self._refused = True
            self.transport.write(_BAD_REQUEST)
        super().send_data()

    def expect_message(self) -> None:
        """Wait for a message, no longer than a connection may be idle."""
        self._receiving = True
        self.table.expect(self, self.table.limits.idle_s)

    def compute(self) -> None:
        """Take as long as the policy takes; the client sends nothing meanwhile."""
        self._receiving = False
        self.table.prove(self)
        self.table.expect(self, None)


class WebsocketServer:
    """Listens from the start and answers while `serve_forever` runs.

    Args:
        service: answers messages.
        metadata: sent first on every connection.
        options: address, key and limits.

    Attributes:
        socket: that listens.

    Raises:
        OSError: the address is in use or not this computer's.
    """

    def __init__(
        self, service: Service, metadata: Mapping[str, Any], options: ServerOptions
    ) -> None:
        self._service, self._metadata, self._options = service, pack(metadata), options
        family = socket.AF_INET6 if ":" in options.host else socket.AF_INET
        self.socket = socket.create_server(
            (options.host, options.port), family=family, backlog=BACKLOG
        )
        self._table: ConnectionTable[_LimitedConnection] = ConnectionTable(
            options.limits, lambda connection: connection.transport.abort()
        )
        # One thread: a policy may belong to the thread that made it.
        self._thread = ThreadPoolExecutor(1, "policy")
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
        loop.set_exception_handler(self._handle_loop_error)
        limits = self._options.limits
        async with serve(
            self._converse,
            sock=self.socket,
            create_connection=self._make_connection,  # type: ignore[arg-type]
            compression=None,
            max_size=self._service.max_request_bytes,
            process_request=self._check_request,
            open_timeout=limits.request_s,
            close_timeout=CLOSE_TIMEOUT_S,
            ping_interval=None,
        ):
            sweeping = loop.create_task(self._end_late())
            await stop.wait()
            sweeping.cancel()
        self._thread.shutdown(wait=False, cancel_futures=True)

    def _make_connection(
        self,
        protocol: ServerProtocol,
        server: Server,
        **options: Any,  # noqa: ANN401 - the library's
    ) -> _LimitedConnection:
        return _LimitedConnection(protocol, server, table=self._table, **options)

    def _handle_loop_error(self, loop: asyncio.AbstractEventLoop, context: dict[str, Any]) -> None:
        """Make room if the process has no more files; the loop accepts again after a second."""
        error = context.get("exception")
        if isinstance(error, OSError) and error.errno in OUT_OF_FILES:
            self._table.make_room()
        else:
            loop.default_exception_handler(context)

    async def _end_late(self) -> None:
        limits = self._options.limits
        shortest = min(limits.request_s, limits.body_s, limits.idle_s)
        while True:
            await asyncio.sleep(min(shortest / _SWEEPS, _MAX_PAUSE_S))
            self._table.end_late()

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
        if not isinstance(connection, _LimitedConnection):
            raise TypeError("the server makes its connections itself")
        loop = asyncio.get_running_loop()
        handle = self._service.connection()
        with contextlib.suppress(ConnectionClosed):
            await connection.send(self._metadata)
            connection.expect_message()
            async for data in connection:
                connection.compute()
                reply = await loop.run_in_executor(self._thread, _answer, handle, data)
                del data  # may be large
                self._table.expect(connection, self._table.limits.body_s)
                await connection.send(reply)
                if isinstance(reply, str):
                    await connection.close(_INTERNAL_ERROR, "Internal server error.")
                    return
                connection.expect_message()


def open_websocket(
    service: Service, metadata: Mapping[str, Any], options: ServerOptions
) -> WebsocketServer:
    """Return a server that listens; it answers once `serve_forever` is called.

    Args:
        service: answers messages.
        metadata: sent first on every connection.
        options: address, key and limits.

    Raises:
        OSError: the address is in use or not this computer's.
    """
    return WebsocketServer(service, metadata, options)


def _answer(handle: Handler, data: bytes | str) -> bytes | str:
    """Return the reply to a message, or the traceback as text."""
    try:
        if isinstance(data, str):
            raise TypeError("Messages must be binary, not text.")
        return pack(handle(unpack(data)))
    except Exception:  # noqa: BLE001 - the boundary: the policy's author sees the traceback
        return traceback.format_exc()
