"""What a wire protocol consists of: a client and a service."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from roboirg.policies.remote.client.remote_policy import RemotePolicy
from roboirg.policies.remote.service import Service


@dataclass(frozen=True)
class Protocol:
    """A wire format between policy servers and their clients.

    Attributes:
        name: unique among all protocols.
        summary: which servers speak it, in a few words.
        memory: what a server remembers between requests, in a few words.
        clients: the policy class of each URL scheme; the class names the transport.
        service: answers the messages of clients with any policy; None if only a client exists.
    """

    name: str
    summary: str
    memory: str
    clients: Mapping[str, type[RemotePolicy]]
    service: type[Service] | None = None

    @property
    def schemes(self) -> tuple[str, ...]:
        """The URL schemes of the clients."""
        return tuple(self.clients)
