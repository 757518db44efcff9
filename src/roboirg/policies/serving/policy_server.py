"""Serve a policy, given by name, in any protocol."""

from __future__ import annotations

from typing import NamedTuple

from roboirg.core.errors import InvalidValueError, UnknownNameError
from roboirg.policies.base import Policy
from roboirg.policies.loading import is_privileged, load_policy_class, make_policy, policy_version
from roboirg.policies.protocols import protocols_by_scheme
from roboirg.policies.remote.endpoints import Endpoint
from roboirg.policies.transport import ListeningServer

LOOPBACK = "127.0.0.1"
_MAX_PORT = 65535


class PolicyServer(NamedTuple):
    """A server that listens.

    Attributes:
        listening: the server.
        url: names the policy for clients.
    """

    listening: ListeningServer
    url: str


def open_server(
    spec: str,
    protocol: str = "mme-vla",
    host: str = LOOPBACK,
    port: int = 0,
    *,
    seed: int = 0,
    key: str | None = None,
) -> PolicyServer:
    """Serve a policy; every episode gets a fresh object with the same seed.

    Args:
        spec: of the policy, as for `roboirg.policies.make_policy`.
        protocol: a scheme of `roboirg.policies.protocols.protocols_by_scheme`.
        host: address to listen at.
        port: port to listen at; 0 for any free one.
        seed: of the policy.
        key: clients must send ``Authorization: Api-Key KEY``; None admits all clients.

    Raises:
        UnknownNameError: there is no such policy or protocol.
        InvalidValueError: the policy is privileged, or the address cannot be used.
        MissingDependencyError: the protocol's network library is not installed.
    """
    protocols = protocols_by_scheme()
    if protocol not in protocols:
        raise UnknownNameError("protocol", protocol, protocols)
    if not 0 <= port <= _MAX_PORT:
        raise InvalidValueError(f"The port is {port}; it must be 0 to {_MAX_PORT}.")
    load_policy_class(spec)
    if is_privileged(spec):
        raise InvalidValueError(
            f"Policy {spec!r} is privileged: it reads the simulator in its own process, so it "
            "cannot be served."
        )

    def make() -> Policy:
        return make_policy(spec, seed)

    found = protocols[protocol]
    metadata = {"policy": spec, "version": policy_version(spec), "protocol": protocol}
    listen = found.clients[protocol].transport.load_server()
    try:
        listening = listen(found.service(make), metadata, host, port, key)
    except OSError as error:
        raise InvalidValueError(f"Cannot listen at {host}:{port} ({error}).") from error
    endpoint = Endpoint(host, listening.socket.getsockname()[1])
    return PolicyServer(listening, f"{protocol}://{endpoint}")
