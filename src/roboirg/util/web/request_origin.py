"""Tell requests of our own clients and pages from those that pages of other sites cause.

A browser sends requests of any page to any address, servers on this machine included. Two headers
give such a page away: ``Origin`` names the page's site, and ``Host`` the name under which the
browser found the server, which for another site's name that leads here (DNS rebinding) is that
site's.
"""

from __future__ import annotations

import os
from collections.abc import Collection, Sequence
from urllib.parse import urlsplit

LOOPBACK = "127.0.0.1"
LOOPBACK_NAMES = (LOOPBACK, "localhost", "::1")
NAMES_VARIABLE = "ROBOIRG_HOST_NAMES"
"""Environment variable with further names of this machine, separated by commas or blanks."""


def is_own_request(hosts: Sequence[str], origins: Sequence[str], names: Collection[str]) -> bool:
    """Return whether a request is addressed to this machine, and not by a page of another site.

    Args:
        hosts: values of the header ``Host``.
        origins: values of the header ``Origin``; programs send none.
        names: names of this machine. An IP address is accepted too: no name leads to it.
    """
    if len(hosts) != 1 or not is_own_host(hosts[0], names):
        return False
    return not origins or list(origins) == [f"http://{hosts[0]}"]


def is_own_host(host: str, names: Collection[str]) -> bool:
    """Return whether ``name:port`` of a request names this machine: by a name or any IP address."""
    try:
        parts = urlsplit(f"//{host}")
        name = parts.hostname or ""
        _ = parts.port  # raises if it is no number
    except ValueError:
        return False
    if parts.netloc != host or "@" in host:
        return False
    return name in names or _is_address(name)


def names_of_this_machine() -> frozenset[str]:
    """Return the names under which clients reach this machine.

    A network may have more, such as that of a container: the user lists them in the variable.
    """
    import socket  # here, because `roboirg --help` needs the names of loopback only

    name = socket.gethostname().lower()
    further = os.environ.get(NAMES_VARIABLE, "").lower().replace(",", " ").split()
    return frozenset({*LOOPBACK_NAMES, name, name.partition(".")[0], *further})


def _is_address(name: str) -> bool:
    """Return whether a name is an IP address, such as ``10.0.0.3`` or ``::1``."""
    import ipaddress

    try:
        ipaddress.ip_address(name)
    except ValueError:
        return False
    return True
