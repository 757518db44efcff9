"""What an episode holds of a server: the right to use it, and a connection."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

from roboirg.core.errors import PolicyConnectionError
from roboirg.policies.remote.connections import Connection, ConnectionSpec
from roboirg.policies.remote.endpoints import Endpoint, RemoteOptions
from roboirg.policies.remote.server_lock import ServerLock, lock_server

Connect = Callable[[ConnectionSpec], Connection]


class ServerSession:
    """Begins and ends with an episode; can begin again.

    Args:
        scheme: of the policy's URL.
        endpoints: the servers to choose from.
        options: how they are spoken to.
        connect: opens a connection.
    """

    def __init__(
        self,
        scheme: str,
        endpoints: Sequence[Endpoint],
        options: RemoteOptions,
        connect: Connect,
    ) -> None:
        self._scheme, self._endpoints = scheme, endpoints
        self._options, self._connect = options, connect
        self._lease: ServerLock | None = None
        self._connection: Connection | None = None

    @property
    def link(self) -> ConnectionSpec:
        """The server in use, for messages the first of those to choose from if there is none."""
        endpoint = self._endpoints[0] if self._lease is None else self._lease.endpoint
        return ConnectionSpec(self._scheme, endpoint, self._options)

    def begin(self) -> Mapping[str, Any]:
        """Take a server, connect, and give its metadata.

        Raises:
            PolicyTimeoutError: all servers were in use for too long, or one said nothing.
            PolicyConnectionError: it cannot be reached.
            PolicyReplyError: it began with something else than its metadata.
        """
        self.end()
        self._lease = lock_server(
            self._endpoints, wait=self._options.wait, shared=self._options.shared
        )
        try:
            self._connection = self._connect(self.link)
        except BaseException:
            self.end()
            raise
        return self._connection.metadata

    def ask(self, message: Mapping[str, Any]) -> dict[str, Any]:
        """Send a message and wait for the reply.

        Raises:
            PolicyConnectionError: the connection broke, or there is none.
            PolicyTimeoutError: the server took too long.
            PolicyReplyError: the server answered with an error, or with no message.
        """
        if self._connection is None:
            raise PolicyConnectionError(f"{self.link} is not connected; call reset() first.")
        return self._connection.ask(message)

    def reconnect(self) -> None:
        """Connect to the same server again.

        Raises:
            PolicyConnectionError: it cannot be reached.
            PolicyTimeoutError: it said nothing.
            PolicyReplyError: it began with something else than its metadata.
        """
        if self._connection is not None:
            self._connection.close()
            self._connection = self._connect(self.link)

    def end(self) -> None:
        """Disconnect and let others have the server; may be called again."""
        connection, self._connection = self._connection, None
        lease, self._lease = self._lease, None
        try:
            if connection is not None:
                connection.close()
        finally:
            if lease is not None:
                lease.release()
