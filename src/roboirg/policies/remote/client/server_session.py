"""The lock and the connection that an episode holds of a policy server."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from roboirg.core.errors import PolicyConnectionError
from roboirg.core.waiting import waiting
from roboirg.policies.remote.client.server_lock import ServerLock, lock_server
from roboirg.policies.remote.connections import Connection, ConnectionSpec
from roboirg.policies.remote.endpoints import Endpoint, RemoteOptions
from roboirg.policies.remote.transport import Connect


class ServerSession:
    """One episode's use of a server; can begin again after its end.

    Args:
        scheme: of the policy's URL.
        endpoints: the servers to choose from.
        options: of their connections.
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
        self._lock: ServerLock | None = None
        self._connection: Connection | None = None

    @property
    def spec(self) -> ConnectionSpec:
        """The server in use, or the first to choose from if there is none."""
        endpoint = self._endpoints[0] if self._lock is None else self._lock.endpoint
        return ConnectionSpec(self._scheme, endpoint, self._options)

    @property
    def _address(self) -> str:
        return f"{self._scheme}://{self.spec.endpoint}"

    def begin(self) -> Mapping[str, Any]:
        """Lock a server, connect, and return its metadata.

        Raises:
            PolicyTimeoutError: all servers were in use for too long, or one sent no metadata.
            PolicyConnectionError: it cannot be reached.
            PolicyReplyError: its metadata are malformed.
        """
        self.end()
        self._lock = lock_server(
            self._endpoints, wait=self._options.wait, shared=self._options.shared
        )
        try:
            with waiting(f"a connection to {self._address}"):
                self._connection = self._connect(self.spec)
        except BaseException:
            self.end()
            raise
        return self._connection.metadata

    def request(self, message: Mapping[str, Any]) -> dict[str, Any]:
        """Send a message and return the reply.

        Raises:
            PolicyConnectionError: the connection broke, or there is none.
            PolicyTimeoutError: the server took too long.
            PolicyReplyError: the server replied with an error, or with no message.
        """
        if self._connection is None:
            raise PolicyConnectionError(f"{self.spec} is not connected; call reset() first.")
        with waiting(f"the reply of {self._address}"):
            return self._connection.request(message)

    def reconnect(self) -> None:
        """Connect to the same server again.

        Raises:
            PolicyConnectionError: it cannot be reached.
            PolicyTimeoutError: it sent no metadata.
            PolicyReplyError: its metadata are malformed.
        """
        if self._connection is not None:
            self._connection.close()
            with waiting(f"a connection to {self._address}"):
                self._connection = self._connect(self.spec)

    def end(self) -> None:
        """Disconnect and unlock the server; repeated calls do nothing."""
        connection, self._connection = self._connection, None
        lock, self._lock = self._lock, None
        try:
            if connection is not None:
                connection.close()
        finally:
            if lock is not None:
                lock.release()
