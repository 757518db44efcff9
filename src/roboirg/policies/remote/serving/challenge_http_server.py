"""Serve a policy over HTTP, as the RoboMME challenge does."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from roboirg.core.extras import extra_needed
from roboirg.policies.remote.message_codec import MSGPACK, pack
from roboirg.policies.remote.server_options import ServerOptions
from roboirg.policies.remote.service import Service
from roboirg.policies.remote.serving.answering_thread import AnsweringThread

with extra_needed("Serving over HTTP needs Starlette and uvicorn", "remote"):
    from starlette.applications import Starlette
    from starlette.exceptions import HTTPException
    from starlette.requests import Request
    from starlette.responses import PlainTextResponse, Response
    from starlette.routing import Route

    from roboirg.util.web.app_server import AppServer, RequestGuard, read_body


def open_http(service: Service, metadata: Mapping[str, Any], options: ServerOptions) -> AppServer:
    """Return a listening server; it answers once `serve_forever` is called.

    Args:
        service: answers requests.
        metadata: response to ``/metadata``.
        options: address, key and time limit.

    Raises:
        InvalidValueError: the address is in use or is not this computer's.
    """
    handle, thread = service.connection(), AnsweringThread()

    async def show_health(request: Request) -> Response:
        del request
        return PlainTextResponse("OK\n")

    async def show_metadata(request: Request) -> Response:
        del request
        return Response(pack(metadata), media_type=MSGPACK)

    async def answer(request: Request) -> Response:
        data = await read_body(request, service.max_request_bytes, options.timeout_s)
        if request.url.path == "/reset":
            data = pack({"reset": True})
        elif not data:
            raise HTTPException(400, "The request is empty.")
        reply = await thread.answer(handle, data)
        if isinstance(reply, str):
            return PlainTextResponse(reply, 500)
        return Response(reply, media_type=MSGPACK)

    def refuse(request: Request) -> Response | None:
        """Refuse foreign pages, and POST without the key, before the body is read."""
        hosts, origins = request.headers.getlist("host"), request.headers.getlist("origin")
        if refusal := options.refusal(hosts, origins):
            return PlainTextResponse(f"{refusal}\n", 403)
        # The challenge's clients send no key with GET.
        key = request.headers.get("authorization")
        if request.method != "GET" and not options.is_authorized(key):
            return PlainTextResponse("The key is missing or wrong.\n", 401)
        return None

    app = Starlette(
        routes=[
            Route("/healthz", show_health),
            Route("/metadata", show_metadata),
            Route("/reset", answer, methods=["POST"]),
            Route("/infer", answer, methods=["POST"]),
        ]
    )
    guard = RequestGuard(app, refuse, {})
    return AppServer(guard, options.host, options.port, options.timeout_s)
