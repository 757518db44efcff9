"""From a policy's name to a server that listens."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, NamedTuple, Protocol

from roboirg.core.errors import InvalidValueError, UnknownNameError
from roboirg.policies.base import Policy
from roboirg.policies.loading import is_privileged, load_policy_class, make_policy, policy_version
from roboirg.policies.remote.endpoints import Endpoint
from roboirg.policies.serving.challenge_http_server import open_http
from roboirg.policies.serving.challenge_server import ChallengeService
from roboirg.policies.serving.mme_vla_server import MmeVlaService
from roboirg.policies.serving.openpi_server import OpenpiService
from roboirg.policies.serving.service import MakePolicy, Service
from roboirg.policies.serving.websocket_server import open_websocket

PROTOCOLS: Mapping[str, Callable[[MakePolicy], Service]] = {
    "openpi": OpenpiService,
    "mme-vla": MmeVlaService,
    "challenge": ChallengeService,
    "challenge+http": ChallengeService,
}
"""By the scheme of the URL with which a client names the server."""
LOOPBACK = "127.0.0.1"
_LARGEST_PORT = 65535


class Listening(Protocol):
    """What websockets' and http.server's servers have in common."""

    socket: Any

    def serve_forever(self) -> None:
        """Answer until `shutdown` is called, by another thread."""

    def shutdown(self) -> None:
        """Stop."""


class PolicyServer(NamedTuple):
    """A server that listens.

    Attributes:
        listening: the server.
        url: what a client names as its policy.
    """

    listening: Listening
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
        protocol: openpi, mme-vla, challenge or challenge+http.
        host: to listen at.
        port: to listen at; 0 for any that is free.
        seed: of the policy.
        key: clients have to send ``Authorization: Api-Key KEY``; None lets everybody in.

    Raises:
        UnknownNameError: there is no such policy or protocol.
        InvalidValueError: the policy is privileged, or the address cannot be listened at.
    """
    if protocol not in PROTOCOLS:
        raise UnknownNameError("protocol", protocol, PROTOCOLS)
    if not 0 <= port <= _LARGEST_PORT:
        raise InvalidValueError(f"The port is {port}; it has to be 0 to {_LARGEST_PORT}.")
    load_policy_class(spec)
    if is_privileged(spec):
        raise InvalidValueError(
            f"Policy {spec!r} looks behind the scenes of a world that plays in the same process; "
            "it cannot be served."
        )

    def make() -> Policy:
        return make_policy(spec, seed)

    metadata = {"policy": spec, "version": policy_version(spec), "protocol": protocol}
    opened = open_http if protocol == "challenge+http" else open_websocket
    try:
        listening: Listening = opened(PROTOCOLS[protocol](make), metadata, host, port, key)
    except OSError as error:
        raise InvalidValueError(f"Nothing can listen at {host}:{port} ({error}).") from error
    place = Endpoint(host, listening.socket.getsockname()[1])
    return PolicyServer(listening, f"{protocol}://{place}")
