"""How the messages of a protocol travel: websocket or HTTP, or a transport of another package."""

from __future__ import annotations

import pkgutil
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any, NamedTuple, Protocol, cast

if TYPE_CHECKING:
    from roboirg.policies.remote.connections import Connection, ConnectionSpec
    from roboirg.policies.remote.server_options import ServerOptions
    from roboirg.policies.remote.service import Service


class ListeningServer(Protocol):
    """What the servers of all transports have in common."""

    socket: Any

    def serve_forever(self) -> None:
        """Answer until `shutdown` is called by another thread."""

    def shutdown(self) -> None:
        """Stop."""


Connect = Callable[["ConnectionSpec"], "Connection"]
Listen = Callable[["Service", Mapping[str, Any], "ServerOptions"], ListeningServer]
"""Called with the service, the metadata, and where to listen and whom to answer."""


class Transport(NamedTuple):
    """Both ends of a way to exchange messages, named by import path and imported on first use.

    Attributes:
        name: one word, for tables.
        client: ``package.module:name`` of a `Connect`.
        server: ``package.module:name`` of a `Listen`.
    """

    name: str
    client: str
    server: str

    def load_client(self) -> Connect:
        """Import what opens a connection."""
        return cast("Connect", pkgutil.resolve_name(self.client))

    def load_server(self) -> Listen:
        """Import what opens a server."""
        return cast("Listen", pkgutil.resolve_name(self.server))


WEBSOCKET = Transport(
    "websocket",
    "roboirg.policies.remote.client.websocket_connection:WebsocketConnection",
    "roboirg.policies.remote.serving.websocket_server:WebsocketServer",
)
"""One binary msgpack message per request and per reply; the metadata come first."""
HTTP = Transport(
    "HTTP",
    "roboirg.policies.remote.client.http_connection:HttpConnection",
    "roboirg.policies.remote.serving.challenge_http_server:open_http",
)
"""The same messages as bodies of ``/infer``, ``{"reset": True}`` as ``/reset``; ``/metadata``."""
