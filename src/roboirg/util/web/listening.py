"""The socket of a server, and its one time limit."""

from __future__ import annotations

from typing import TYPE_CHECKING

from roboirg.core.errors import InvalidValueError

if TYPE_CHECKING:
    import socket

TIMEOUT_S = 1800.0
"""How long a connection may be idle, and a message may take to arrive."""
_BACKLOG = 128


def listen(host: str, port: int) -> socket.socket:
    """Return a socket that listens.

    Raises:
        InvalidValueError: the port is not available, or the address is not this machine's.
    """
    import socket  # here, because `roboirg --help` needs the time limit only

    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    try:
        return socket.create_server((host, port), family=family, backlog=_BACKLOG)
    except (OSError, OverflowError) as error:
        raise InvalidValueError(
            f"Cannot listen on {host}:{port} ({error}); choose another port, or 0 for any free one."
        ) from error
