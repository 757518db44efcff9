"""Serve an application of Starlette with uvicorn: whom it answers, and how large a request is."""

from __future__ import annotations

import logging
import threading
from collections.abc import Callable, Mapping
from typing import Self

import uvicorn
from starlette.datastructures import MutableHeaders
from starlette.exceptions import HTTPException
from starlette.requests import ClientDisconnect, Request
from starlette.responses import PlainTextResponse, Response
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from roboirg.util.web.listening import TIMEOUT_S, listen
from roboirg.util.web.request_origin import LOOPBACK

_LAST = {"Connection": "close"}
"""Header of a response after which nothing more is read, such as the rest of a body."""
_STOP_S = 1
"""Seconds that requests have to end when the server stops."""


class AppServer:
    """Listens from the start and answers while `serve_forever` runs; a context manager.

    Args:
        app: answers requests.
        port: of this computer; 0 for any free one.

    Attributes:
        socket: that listens.
    """

    def __init__(self, app: ASGIApp, port: int = 0) -> None:
        self.socket = listen(LOOPBACK, port)
        self._server = uvicorn.Server(
            uvicorn.Config(
                app,
                http="h11",
                ws="none",
                lifespan="off",
                log_config=None,
                log_level="error",
                access_log=False,  # addresses may hold a key
                proxy_headers=False,
                server_header=False,
                timeout_keep_alive=int(TIMEOUT_S),
                timeout_graceful_shutdown=_STOP_S,
            )
        )
        self._ended = threading.Event()
        self._ended.set()

    @property
    def port(self) -> int:
        """The port at which the server listens."""
        return int(self.socket.getsockname()[1])

    def serve_forever(self) -> None:
        """Answer until `shutdown` is called by another thread, or Ctrl-C."""
        self._ended.clear()
        # Outside of the main thread, uvicorn leaves Ctrl-C to the command.
        threading.Thread(target=self._run, name="HTTP server", daemon=True).start()
        # Python 3.11 takes a thread for ended once its `join` was interrupted.
        self._ended.wait()

    def _run(self) -> None:
        """Answer requests; runs in a thread."""
        try:
            self._server.run([self.socket])
        finally:
            self._ended.set()

    def shutdown(self) -> None:
        """Stop."""
        # That requests end with the server is no error; the next server resets the level.
        logging.getLogger("uvicorn.error").setLevel(logging.CRITICAL)
        self._server.should_exit = True

    def server_close(self) -> None:
        """Stop, and close the socket; repeated calls do nothing."""
        self.shutdown()
        self._ended.wait(2 * _STOP_S)
        self.socket.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *error: object) -> None:
        self.server_close()


class RequestGuard:
    """Passes requests on to an application unless they are refused, and adds headers.

    Args:
        app: answers requests.
        refuse: returns the response to a request that the application must not see, else None.
        headers: of every response that has none of the same name.
    """

    def __init__(
        self,
        app: ASGIApp,
        refuse: Callable[[Request], Response | None],
        headers: Mapping[str, str],
    ) -> None:
        self._app = app
        self._refuse = refuse
        self._headers = {"X-Content-Type-Options": "nosniff", **headers}

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer a request (ASGI), or refuse it; either answer gets the headers of this guard."""

        async def send_with_headers(message: Message) -> None:
            """Send a part of the answer; its first part gets the headers that it lacks."""
            if message["type"] == "http.response.start":
                headers = MutableHeaders(scope=message)
                for name, value in self._headers.items():
                    headers.setdefault(name, value)
            await send(message)

        answer = self._app
        refusal = self._refuse(Request(scope, receive))
        if refusal is not None:
            refusal.headers.update(_LAST)
            answer = refusal
        await answer(scope, receive, send_with_headers)


async def read_body(request: Request, limit: int) -> bytes:
    """Return the body of a request of at most `limit` bytes.

    Raises:
        HTTPException: it is too large or cut short.
    """
    if int(request.headers.get("content-length", 0)) > limit:
        raise HTTPException(413, "Too large.", _LAST)
    try:
        return await request.body()
    except ClientDisconnect as error:
        raise HTTPException(400, "The request is cut short.") from error


def error_handler(status: int) -> Callable[[Request, Exception], Response]:
    """Return Starlette's handler of errors that answers with the error's message as plain text."""
    return lambda _, error: PlainTextResponse(f"{error}\n", status)
