"""The wire protocols, one file each; a file that defines ``PROTOCOL`` is a protocol.

Installed packages add theirs through entry points of the group ``roboirg.protocols``. Nothing here
imports a network library before a server is named.
"""

from __future__ import annotations

import functools
from collections.abc import Mapping
from dataclasses import dataclass

from roboirg.policies.remote.remote_policy import RemotePolicy
from roboirg.policies.remote.service import Service
from roboirg.util.discovery import discover

__all__ = ["Protocol", "protocols_by_scheme", "served_protocols"]


@dataclass(frozen=True)
class Protocol:
    """A wire format between policy servers and their clients: msgpack over a websocket.

    Attributes:
        name: unique among all protocols; the scheme of URLs.
        client: makes policies of URLs.
        service: answers the messages of clients with any policy; None if only a client exists.
    """

    name: str
    client: type[RemotePolicy]
    service: type[Service] | None = None


@functools.cache
def protocols_by_scheme() -> Mapping[str, Protocol]:
    """Return all protocols by name: ours by file, then those of installed packages."""
    return discover(__name__, "PROTOCOL", Protocol, "roboirg.protocols")


def served_protocols() -> list[str]:
    """Return the names of those that have a service."""
    protocols = protocols_by_scheme().values()
    return [protocol.name for protocol in protocols if protocol.service is not None]
