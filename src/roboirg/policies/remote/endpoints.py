"""Where a remote policy is: one or several servers, and the options all protocols have."""

from __future__ import annotations

import os
import socket
from typing import NamedTuple
from urllib.parse import urlsplit

from pydantic import Field

from roboirg.core.errors import InvalidValueError
from roboirg.policies.policy_urls import PolicyUrl, UrlOptions

MIB = 2**20
_LOOPBACK = {"localhost", "127.0.0.1", "::1"}


class Endpoint(NamedTuple):
    """A server's host, lower case, and port."""

    host: str
    port: int

    def __str__(self) -> str:
        return f"[{self.host}]:{self.port}" if ":" in self.host else f"{self.host}:{self.port}"

    @property
    def identity(self) -> str:
        """The same for every way to write this computer, and good as a file name."""
        here = self.host in _LOOPBACK
        host = f"{socket.gethostname()}-itself" if here else self.host.replace(":", "_")
        return f"{host}-{self.port}"


class RemoteOptions(UrlOptions):
    """What can be asked of every remote policy.

    Attributes:
        timeout: seconds to wait for a reply.
        connect: seconds to try to connect.
        wait: seconds to wait for a server that another episode uses.
        shared: whether several episodes may use a server at the same time.
        tls: whether to encrypt (wss, https).
        api_key_env: name of the environment variable that holds the server's key.
        max_reply_mib: the largest reply that is accepted, MiB.
        version: of the checkpoint, for the records.
    """

    timeout: float = Field(60.0, gt=0)
    connect: float = Field(60.0, gt=0)
    wait: float = Field(3600.0, ge=0)
    shared: bool = False
    tls: bool = False
    api_key_env: str | None = Field(None, min_length=1)
    max_reply_mib: float = Field(64.0, gt=0)
    version: str | None = Field(None, min_length=1)

    @property
    def headers(self) -> dict[str, str]:
        """Headers of a request.

        Raises:
            InvalidValueError: the environment variable with the key is not set.
        """
        if self.api_key_env is None:
            return {}
        key = os.environ.get(self.api_key_env)
        if not key:
            raise InvalidValueError(
                f"The environment variable {self.api_key_env} (option api_key_env) holds no key."
            )
        return {"Authorization": f"Api-Key {key}"}

    @property
    def max_reply(self) -> int:
        """The largest reply that is accepted, bytes."""
        return int(self.max_reply_mib * MIB)


def read_endpoints(url: PolicyUrl) -> tuple[Endpoint, ...]:
    """The servers that a URL names, separated by commas.

    Raises:
        InvalidValueError: something is no ``host:port``, or is named twice.
    """
    found = tuple(_endpoint(url, part) for part in url.place.rstrip("/").split(","))
    for endpoint in found:
        if found.count(endpoint) > 1:
            raise InvalidValueError(f"Policy {url.text!r} names {endpoint} twice.")
    return found


def _endpoint(url: PolicyUrl, text: str) -> Endpoint:
    if "@" in text:
        raise InvalidValueError(
            f"Policies of {url.scheme}:// hold no key or password in the URL; put it into an "
            "environment variable and name that with api_key_env=NAME."
        )
    try:
        parts = urlsplit(f"//{text}")
        host, port = parts.hostname, parts.port
    except ValueError:
        host, port = None, None
    if not host or not port or parts.path or parts.fragment or " " in text:
        raise InvalidValueError(
            f"Policy {url.text!r}: {text!r} is no server; write {url.scheme}://host:port, several "
            "with commas."
        )
    return Endpoint(host, port)
