"""The wire protocols, one file each; a file that defines ``PROTOCOL`` is a protocol.

Installed packages add theirs through entry points of the group ``roboirg.protocols``. Nothing here
imports a network library before a server is named.
"""

from __future__ import annotations

import functools
import sys
from collections.abc import Mapping

from roboirg.core.errors import InvalidValueError
from roboirg.policies.remote.protocol import Protocol
from roboirg.util.discovery import discover

__all__ = ["all_protocols", "protocols_by_scheme"]


@functools.cache
def all_protocols() -> tuple[Protocol, ...]:
    """Return every protocol: ours by file name, then those of installed packages."""
    return tuple(discover(sys.modules[__name__], "PROTOCOL", Protocol, "roboirg.protocols"))


@functools.cache
def protocols_by_scheme() -> Mapping[str, Protocol]:
    """Return the protocol of each URL scheme.

    Raises:
        InvalidValueError: two protocols have the same scheme.
    """
    found: dict[str, Protocol] = {}
    for protocol in all_protocols():
        for scheme in protocol.schemes:
            if scheme in found:
                raise InvalidValueError(
                    f"The protocols {found[scheme].name!r} and {protocol.name!r} both have the "
                    f"scheme {scheme}://; rename one."
                )
            found[scheme] = protocol
    return found
