"""Serve over a websocket: metadata first, then a reply per message, errors as text.

Connections are coroutines of one thread; the policy has a thread of its own, so health checks are
answered while it computes.
"""

from __future__ import annotations

import asyncio
import contextlib
import hmac
import http
import traceback
from collections.abc import Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from roboirg.core.error_words import one_line
from roboirg.core.extras import extra_needed
from roboirg.core.plain_text import printable
from roboirg.policies.remote.message_codec import pack, unpack
from roboirg.policies.remote.service import Service
from roboirg.util.web.listening import TIMEOUT_S, listen
from roboirg.util.web.request_origin import LOOPBACK, is_own_request, names_of_this_machine

with extra_needed("Serving policies needs websockets 17.4 or newer", "remote"):
    from websockets.asyncio.server import ServerConnection, serve
    from websockets.exceptions import ConnectionClosed

if TYPE_CHECKING:
    from websockets.http11 import Request, Response

CLOSE_TIMEOUT_S = 2.0
_INTERNAL_ERROR = 1011


@dataclass(frozen=True)
class ServerOptions:
    """Where a policy server listens, and whom it answers.

    Attributes:
        host: address to listen at.
        port: port to listen at; 0 for any free one.
        key: clients must send ``Authorization: Api-Key KEY``; None admits all clients.
        timeout_s: how long a connection may be idle, and a message may take to arrive.
    """

    host: str = LOOPBACK
    port: int = 0
    key: str | None = field(default=None, repr=False)
    timeout_s: float = TIMEOUT_S


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
        """Listen at once; answer once `serve_forever` is called."""
        self._service = service
        self._metadata = pack(metadata)
        self._options = options
        self.socket = listen(options.host, options.port)
        # One thread, as a policy may belong to the thread that made it.
        self._policy = ThreadPoolExecutor(1, "policy")
        self._runner = asyncio.Runner(loop_factory=asyncio.new_event_loop)
        self._loop = self._runner.get_loop()
        self._stop = asyncio.Event()

    def serve_forever(self) -> None:
        """Answer until `shutdown` is called by another thread; policies are closed at the end."""
        with self._policy, contextlib.ExitStack() as ends, self._runner:
            ends.callback(self._policy.submit, self._service.forget)
            self._runner.run(self._serve())

    def shutdown(self) -> None:
        """Stop."""
        with contextlib.suppress(RuntimeError):  # it has stopped
            self._loop.call_soon_threadsafe(self._stop.set)

    async def _serve(self) -> None:
        """Accept connections until `shutdown` is called."""
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
            await self._stop.wait()

    def _check_request(self, connection: ServerConnection, request: Request) -> Response | None:
        """Return the response that refuses a request or says that all is well; None to connect.

        Pages of other websites are refused first, as a browser sends their requests, too.
        """
        headers = request.headers
        names = {*names_of_this_machine(), self._options.host.lower()}
        if not is_own_request(headers.get_all("Host"), headers.get_all("Origin"), names):
            return connection.respond(
                http.HTTPStatus.FORBIDDEN,
                "The Origin or Host of this request is not this server's; if clients reach it "
                "under another name, list it in ROBOIRG_HOST_NAMES of roboirg serve.\n",
            )
        if request.path == "/healthz":
            return connection.respond(http.HTTPStatus.OK, "OK\n")
        if not self._has_key("\n".join(headers.get_all("Authorization"))):
            return connection.respond(
                http.HTTPStatus.UNAUTHORIZED, "The key is missing or wrong.\n"
            )
        return None

    def _has_key(self, authorization: str) -> bool:
        """Return whether a request has the server's key, if there is one."""
        if self._options.key is None:
            return True
        expected = f"Api-Key {self._options.key}"
        return hmac.compare_digest(authorization.encode(), expected.encode())

    async def _converse(self, connection: ServerConnection) -> None:
        """Send the metadata, then reply to each message until the client or an error ends it.

        An idle or slow client ends it after `timeout_s`; after an error, its traceback is the last
        reply.
        """
        service = self._service.connection()
        timeout_s = self._options.timeout_s
        with contextlib.ExitStack() as ends, contextlib.suppress(ConnectionClosed, TimeoutError):
            if service is not self._service:
                # The policy is this connection's alone, so it is closed with it, in its thread.
                ends.callback(self._policy.submit, service.forget)
            await connection.send(self._metadata)
            while True:
                async with asyncio.timeout(timeout_s):
                    data = await connection.recv()
                reply = await self._loop.run_in_executor(self._policy, _answer, service, data)
                del data  # may be large
                async with asyncio.timeout(timeout_s):
                    await connection.send(reply)
                if isinstance(reply, str):
                    await connection.close(_INTERNAL_ERROR, "Internal server error.")
                    return


def _answer(service: Service, data: bytes | str) -> bytes | str:
    """Return the reply to a message in bytes, or the traceback of an error as a text.

    Runs in the policy's thread. The last line of the text is the error in one sentence.
    """
    try:
        if isinstance(data, str):
            raise TypeError("Messages must be binary, not text.")
        return pack(service.handle(unpack(data)))
    except (Exception, SystemExit) as error:  # noqa: BLE001 - the boundary: the policy's author needs the traceback
        return printable(traceback.format_exc()) + one_line(error)  # clients show the last line
