"""Where a policy server listens, and whom it answers."""

from __future__ import annotations

import hmac
from collections.abc import Sequence
from dataclasses import dataclass, field

from roboirg.util.web.listening import TIMEOUT_S
from roboirg.util.web.request_origin import LOOPBACK, is_own_request, names_of_this_machine


@dataclass(frozen=True)
class ServerOptions:
    """Options of every policy server.

    Attributes:
        host: address to listen at.
        port: port to listen at; 0 for any free one.
        key: clients must send ``Authorization: Api-Key KEY``; None admits all clients.
        timeout_s: how long a connection may be idle, and a message may take to arrive.
    """

    host: str = LOOPBACK
    port: int = 0
    key: str | None = field(default=None, repr=False)
    timeout_s: float = TIMEOUT_S

    def refusal(self, hosts: Sequence[str], origins: Sequence[str]) -> str | None:
        """Return why a request must be refused that a page of another site may have caused.

        Args:
            hosts: values of the header ``Host``.
            origins: values of the header ``Origin``.
        """
        names = {*names_of_this_machine(), self.host.lower()}
        if is_own_request(hosts, origins, names):
            return None
        return (
            "The Origin or Host of this request is not this server's; if clients reach it under "
            "another name, list it in ROBOIRG_HOST_NAMES of roboirg serve."
        )

    def is_authorized(self, header: str | None) -> bool:
        """Return whether the header ``Authorization`` holds the key, or no key is needed."""
        if self.key is None:
            return True
        return hmac.compare_digest((header or "").encode(), f"Api-Key {self.key}".encode())
